"""The materials of the seven objects and those to choose from, and the forces that dent a body visibly."""

from dataclasses import replace

import numpy as np

from odeform.errors import InputError
from odeform.geometry.contact import RADIUS, SurfacePoint
from odeform.simulation.objects.soft_object import SoftMaterial, SoftObject
from odeform.simulation.objects.thickness import thickness_at
from odeform.surroundings import GRAVITY

__all__ = ["CHOICE", "FORCES", "MATERIALS", "forces_at", "forces_on", "material_name", "material_of"]

SILICONE = "silicone Ecoflex 00-50, cast solid: 83 kPa at 100 %, 1,070 kg/m^3 (Smooth-On, technical bulletin)"
FOAM = "flexible polyurethane foam: 10 to 200 kPa, 25 to 300 kg/m^3 (Gibson and Ashby 1997, Cellular Solids, ch. 5)"
CRUMB = "bread crumb: 8 to 50 kPa, 200 to 300 kg/m^3 (Scanlon and Zghal 2001, Food Research International 34, 841)"
RUBBER = "sponge rubber, near EVA foam of 150 to 250 kg/m^3 (Verdejo and Mills 2002, The Engineering of Sport 4, 580)"
CHIP = "moist tortilla chip; a crisp one is stiffer and breaks (Kawas and Moreira 2001, J. Food Engineering 47, 97)"

MATERIALS: dict[str, SoftMaterial] = {
    "bottle": SoftMaterial(83e3, 0.4, 1070.0, 0.004, 0.6, SILICONE),
    "cat": SoftMaterial(69e3, 0.4, 300.0, 0.004, 0.6, FOAM),
    "dog": SoftMaterial(100e3, 0.35, 250.0, 0.004, 0.6, FOAM),
    "donut": SoftMaterial(30e3, 0.3, 250.0, 0.004, 0.5, CRUMB),
    "chip": SoftMaterial(1.3e6, 0.3, 600.0, 0.003, 0.4, CHIP, 0.0025),
    "flip-flop": SoftMaterial(250e3, 0.3, 400.0, 0.003, 0.6, RUBBER),
    "pillow": SoftMaterial(15e3, 0.2, 50.0, 0.005, 0.5, FOAM),
}
FORCES: dict[str, tuple[float, float]] = {
    "bottle": (2.0, 8.0),
    "cat": (4.0, 15.0),
    "dog": (5.0, 22.0),
    "donut": (1.0, 4.0),
    "chip": (0.3, 1.2),
    "flip-flop": (2.0, 7.0),
    "pillow": (2.0, 6.0),
}
"""Newton, weakest and strongest."""

PLUSH = (
    "polyester filling, as the softest flexible foams: 10 kPa and more, 25 kg/m^3 and more (Gibson and Ashby, ch. 5)"
)
DOUGH = "chosen: the order of magnitude of wheat dough at small strain (Uthayakumaran et al. 2002, Rheol. Acta 41)"
NATURAL = "soft natural rubber of Shore A 20: 0.7 MPa (Gent 1958, Rubber Chem. Technol. 31, 896), 1,000 kg/m^3"
BOARD = "chosen: corrugated board that is pressed flat, of which no published figure was found"
CORK = "cork: 13 to 20 MPa, 170 kg/m^3, Poisson's ratio 0 to 0.1 (Gibson et al. 1981, Proc. R. Soc. A 377, 99)"

CHOICE: dict[str, SoftMaterial] = {
    "plush": SoftMaterial(12e3, 0.2, 50.0, 0.005, 0.6, PLUSH),
    "dough": SoftMaterial(25e3, 0.4, 1150.0, 0.005, 0.6, DOUGH),
    "foam": SoftMaterial(60e3, 0.3, 120.0, 0.004, 0.6, FOAM),
    "silicone": SoftMaterial(83e3, 0.4, 1070.0, 0.004, 0.6, SILICONE),
    "rubber": SoftMaterial(700e3, 0.4, 1000.0, 0.003, 0.8, NATURAL),
    "cardboard": SoftMaterial(1e6, 0.2, 150.0, 0.003, 0.4, BOARD),
    "cork": SoftMaterial(13e6, 0.1, 170.0, 0.003, 0.5, CORK),
}
"""What a shape of the user's own can be of, from soft to stiff."""
DENT, LIFTS, WEAKEST = 0.12, 3.0, 0.3
"""The strongest force presses a sphere into a half-space by that part of the thickness (Hertz), or is that many weights
of the body, whichever is less; the weakest is that part of it."""


def material_of(text: str) -> SoftMaterial:
    """A material by name, or by Young's modulus in kPa and density in kg/m^3, as "60:120". `InputError` for others."""
    if text in CHOICE:
        return CHOICE[text]
    try:
        young, density = (float(part) for part in text.split(":"))
    except ValueError:
        young = density = 0.0
    if not (0.1 <= young <= 1e5 and 1.0 <= density <= 2e4):
        raise InputError(
            f"material {text!r}: expected one of {', '.join(CHOICE)}, or KPA:DENSITY, as 60:120, of 0.1 to 100,000 kPa "
            "and 1 to 20,000 kg/m^3"
        )
    return SoftMaterial(1e3 * young, 0.3, density, 0.004, 0.6, "given")


def material_name(material: SoftMaterial) -> str:
    """What `material_of` reads as that material: the name of one to choose from, or stiffness and density."""
    numbers = f"{1e-3 * material.young:g}:{material.density:g}"
    unnamed = replace(material, source="")  # its words may change
    return next((name for name, known in CHOICE.items() if replace(known, source="") == unnamed), numbers)


def forces_on(material: SoftMaterial, thickness: float, mass: float) -> tuple[float, float]:
    """Newton, weakest and strongest on a body of that `thickness` in m and `mass` in kg."""
    stiffness = material.young / (1.0 - material.poisson**2)
    dents = 4.0 / 3.0 * stiffness * np.sqrt(RADIUS) * (DENT * thickness) ** 1.5
    strongest = float(min(dents, LIFTS * GRAVITY * mass))
    return WEAKEST * strongest, strongest


def forces_at(item: SoftObject, contact: SurfacePoint) -> tuple[float, float]:
    """Newton, weakest and strongest at a contact on the resting surface of a user's own body.

    They are those of the body (`SoftObject.forces`), or less where it is thinner than in the median: what dents its
    trunk visibly breaks an ear.
    """
    thickness = thickness_at(item.rest_mesh(), contact)
    dents = forces_on(item.material, thickness, item.mass)
    return min(item.forces[0], dents[0]), min(item.forces[1], dents[1])
