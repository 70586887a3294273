"""Identification of drawn bodies that are pushed, of which all is known, as a table."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.identification.identify import Identification
from odeform.identification.pushed.drawn import drawn_states, forward_of, seen
from odeform.identification.pushed.experiment import Experiment
from odeform.identification.pushed.forward import Forward
from odeform.identification.pushed.identify import PUSHED, identify_body, identify_push
from odeform.identification.pushed.simulator import experiment_simulator
from odeform.identification.pushed.state import BODY, PUSH_NAMES, PushState
from odeform.identification.pushed.together import Made, Together, simulated_together
from odeform.identification.pushed.trials import Falls
from odeform.identification.pushed.views import CloudView
from odeform.loads.registry import PUSH, get_load
from odeform.models.base import Predictor
from odeform.models.conformal import conformal_factor
from odeform.progress import Progress
from odeform.schema import OBJECT
from odeform.simulation.errors import SimulationError

__all__ = ["NOMINAL", "TINY", "identify_drawn", "report_drawn"]

NOMINAL = 0.9
DRAWN = 4
"""Falls of which the first that lands in time is made."""
TINY = 1e-9  # of an interval; an error of zero has no logarithm


def identify_drawn(
    predictor: Predictor,
    objects: Sequence[str],
    count: int,
    view: CloudView | None = None,
    noise_mm: float = 0.0,
    seed: int = 0,
    from_simulator: bool = False,
    known: Sequence[str] = (),
    simulations: int = 0,
    falls: Sequence[str] = (),
) -> dict[str, Any]:
    """Scores, and a row for each of `count` drawn bodies of each object.

    Their motion is that of the model itself, whose error is then zero, or that of the simulator. `known` are those of
    mass, young, friction and push that the search is told. With `simulations`, the model is corrected by so many of
    each body. With `falls`, "drop" or "throw", each body also falls so, and it is identified from a known push and
    these together.
    """
    if falls and PUSHED not in known:
        raise InputError("identify: drops and throws are known; expected the push to be known beside them")
    if simulations and not from_simulator:
        raise InputError("identify: simulations correct the model for bodies that the simulator moves, not the model")
    asked = _Asked(view, noise_mm, from_simulator, known, simulations, falls)
    rows: list[dict[str, Any]] = []
    progress = Progress("identify", count * len(objects))
    for name in objects:
        forward = forward_of(predictor, name)
        for index, state in enumerate(drawn_states(predictor, name, count, seed)):
            try:
                rows.append(_row(name, state, asked.identified(predictor, name, forward, state, seed + index)))
            except SimulationError as error:  # too strong a push of too soft a body; the others count
                progress.advance(1, f"{name}: {error}")
            else:
                progress.advance(1, _note(rows[-1]))
    progress.close()
    if not rows:
        raise InputError("identify: expected a body that can be simulated; none of those drawn could")
    names = [name for name in (*BODY, "contact", "force") if name in rows[0]["parameters"]]
    return {
        "truth": "simulator" if from_simulator else "model",
        "view": "all points" if view is None else f"{view.points} points a frame of half of the surface",
        "noise_mm": noise_mm,
        "simulations": simulations,
        "falls": list(falls),
        "seconds": float(np.median([row["seconds"] for row in rows])),
        "bodies": len(rows),
        "parameters": {name: _scores(name, rows) for name in names},
        "factor_90": _factor(rows),
        "rows": rows,
    }


@dataclass(frozen=True)
class _Asked:
    """How bodies are moved and seen, and what the search is told: see `identify_drawn`."""

    view: CloudView | None
    noise_mm: float
    from_simulator: bool
    known: Sequence[str]
    simulations: int
    falls: Sequence[str]

    def identified(
        self, predictor: Predictor, name: str, forward: Forward, state: PushState, seed: int
    ) -> Identification:
        """Moves one body, and estimates it. `SimulationError` for one that cannot be simulated."""
        made = _made(forward, state, self.falls, seed)
        each = Together(forward.model, made, forward.named)
        if self.from_simulator:
            surface = simulated_together(each, experiment_simulator(forward, name))(state)
        else:
            surface = each.motions([state])[0]
        evidence = seen(each, surface, self.view, self.noise_mm, seed)
        errors = None if self.from_simulator else np.zeros(len(each.times))
        given = _given(name, state, self.known)
        if not self.falls:
            return identify_push(predictor, evidence, given, errors, simulations=self.simulations)
        of_body = {key: value for key, value in given.items() if key not in PUSH_NAMES}
        return identify_body(predictor, made, evidence, of_body, errors, simulations=self.simulations)


def _made(forward: Forward, state: PushState, falls: Sequence[str], seed: int) -> list[Made]:
    """The push of a state, and one fall under each load, of which it is known when the body lands."""
    made = [Made(Experiment(PUSH, state.parameters()), forward.times)]
    for load in falls:
        drawn = Falls(forward, state.body, get_load(load), DRAWN, seed)
        made += [Made(one, times) for one, times in zip(drawn.experiments[:1], drawn.times, strict=False)]
    return made


def _given(name: str, state: PushState, known: Sequence[str]) -> dict[str, Any]:
    """What the search is told: the object, and those `known` of the body and the push."""
    push = {key: value for key, value in state.parameters().items() if key not in BODY} if PUSHED in known else {}
    return {OBJECT: name, **push, **{key: state.value(key) for key in known if key in BODY}}


def _note(row: dict[str, Any]) -> str:
    errors = ", ".join(f"{name} off by {one['error']:.3f}" for name, one in row["parameters"].items())
    return f"{row['object']}: {errors}; {row['seconds']:.1f} s"


def _row(name: str, state: PushState, found: Identification) -> dict[str, Any]:
    """Errors in fractions of the range, from half to twice the body's own; of the push in mm and N."""
    one: dict[str, Any] = {"object": name, "misfit": found.misfit, "seconds": found.seconds, "parameters": {}}
    for index, key in enumerate(BODY):
        if key in found.parameters:
            each, true = found.parameters[key], float(state.body[index])
            one["parameters"][key] = {
                "true": true,
                "found": each.unit,
                "error": abs(each.unit - true) / 2.0,
                "inside": bool(abs(each.unit - true) <= each.half_width),
                "half_width": each.half_width,
                "identifiable": each.identifiable,
            }
    for kind, vector, factor in (("contact", state.contact, 1e3), ("force", state.force, 1.0)):
        if f"{kind}_x" not in found.parameters:
            continue
        parts = [found.parameters[f"{kind}_{axis}"] for axis in "xyz"]
        off = np.array([part.value for part in parts]) - vector
        halves = np.array([part.half_width for part in parts]) * (state.size if kind == "contact" else state.strongest)
        one["parameters"][kind] = {
            "error": factor * float(np.linalg.norm(off)),
            "inside": float((np.abs(off) <= halves).mean()),
            "identifiable": all(part.identifiable for part in parts),
        }
    return one


def _factor(rows: Sequence[dict[str, Any]]) -> float | None:
    """By how much to widen intervals so that nine in ten of further masses, stiffnesses and frictions lie within; None
    for too few. Those of one body are not independent of each other, so that their number says more than it is."""
    every = [one for row in rows for key, one in row["parameters"].items() if key in BODY]
    return conformal_factor(np.log([max(2.0 * one["error"] / one["half_width"], TINY) for one in every]), NOMINAL)


def _scores(name: str, rows: Sequence[dict[str, Any]]) -> dict[str, float | None]:
    each = [row["parameters"][name] for row in rows]
    sure = [one for one in each if one["identifiable"]]
    return {
        "mae": float(np.mean([one["error"] for one in each])),
        "median": float(np.median([one["error"] for one in each])),
        "inside_90": float(np.mean([one["inside"] for one in each])),
        "identifiable": len(sure) / len(each),
        "mae_identifiable": float(np.mean([one["error"] for one in sure])) if sure else None,
    }


def report_drawn(result: dict[str, Any]) -> str:
    """Returns the result as a text table."""
    made = " and ".join(["push", *result["falls"]])
    lines = [
        f"{result['bodies']} bodies moved by the {result['truth']}, {made}, {result['view']}, "
        f"{result['noise_mm']:g} mm of noise, {result['simulations']} simulations; "
        f"{result['seconds']:.1f} s each (median)",
        f"{'':<12}{'MAE':>10}{'median':>10}{'in 90 %':>10}{'identifiable':>14}   of",
    ]
    units = {"contact": "mm", "force": "N"}
    for name, one in result["parameters"].items():
        scores = f"{one['mae']:>10.3f}{one['median']:>10.3f}{one['inside_90']:>10.0%}{one['identifiable']:>14.0%}"
        lines.append(f"{name:<12}{scores}   {units.get(name, 'the range')}")
    if result["factor_90"] is not None:
        wide = f"{result['factor_90']:.2f} times as wide"
        lines.append(f"intervals {wide} would hold nine in ten of mass, young and friction")
    return "\n".join(lines)
