"""The materials of the seven objects, and the forces that dent each visibly."""

from odeform.simulation.objects.soft_object import SoftMaterial

__all__ = ["FORCES", "MATERIALS"]

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
