"""The paper's tables on the available scenes: which model is trained on what, how long, and scored on which frames.

Budgets are steps, so that the speed of a machine does not change the models.
"""

from collections.abc import Iterable
from dataclasses import replace

from odeform_figures.tables.paper import UNSEEN_OBJECTS
from odeform_figures.tables.runs import Run

__all__ = [
    "AHEAD",
    "BALLS",
    "DROP",
    "FINAL",
    "FORCE",
    "FRAMES",
    "IMPACT",
    "INTERVALS",
    "MINUTES",
    "OURS",
    "PUSH",
    "UNTIL",
    "plan",
]

DROP, FORCE = "mass-elastic", "contact-force"
FRAMES = {DROP: (0, 151), "kick": (0, 121), FORCE: (0, 20)}
"""All frames of each scene."""
BALLS = (DROP, "kick")
PUSH = (11, 16)
"""Extrapolation of pushed objects, as in the paper: trained to frame 10, scored on the next five frames."""
FINAL = (19, 20)
"""The last frame of pushed objects: what `pe-gnn` predicts, and what the other models have there."""
IMPACT = (30, 89)
"""Frames of the drop from just before the first contact to after the second; every 3rd, 5th and 8th ends beyond."""
OURS, LATENT = "odeform-rolling", "odeform"
"""The model of the balls whose seeds, ablations and learning curve are shown; and the latent ODE of the paper."""
SEEDS = (0, 1, 2)
"""Seeds of `OURS`. The best baselines are deterministic."""
UNTIL, AHEAD = (40, 70), 10
"""Extrapolation of the drop: trained frames, to the end of the first contact or into the second; frames predicted."""
INTERVALS = (3, 5, 8)
SOLVED = ("pod-rbf", "gp", "nearest")
BASELINES = (*SOLVED, "direct", "node", "rnn")
SCORED_PUSHES = {"pe-gnn": (FINAL,), **dict.fromkeys(("odeform", *SOLVED), (FRAMES[FORCE], FINAL))}
"""Windows of pushed objects on which models are scored, if not on all frames alone."""
FEWER = {DROP: (44, 88, 175), "kick": (63, 126, 253), FORCE: (25, 50, 100)}
"""Training sequences of the learning curve, of each object: about an eighth, a quarter and a half of all."""
ABLATED = {
    (OURS, DROP): ((), ("residual",), ("network",)),
    (OURS, "kick"): ((), ("residual",), ("network",), ("corners",)),
    (LATENT, DROP): (
        (),
        ("residual",),
        *((*parts, "residual") for parts in (("ode",), ("clock",), ("parameters",), ("clock", "parameters"))),
        ("random-features", "residual"),
    ),
}
"""Parts that ablations leave out, by model and scene. Of the latent ODE, the regression of what is left would hide what
other parts give."""
SEEDLESS = (OURS, DROP, ("network",))
"""Ablations whose remainder has nothing random: other seeds give the same model."""
MINUTES = {DROP: 4, "kick": 12}
"""About what the budget of each scene took on an idle core when it was set."""
PUSH_STEPS = {"direct": 4800, "node": 2400, "rnn": 3300, "pe-gnn": 8400}
"""Steps of all seven pushed objects together. They took 5 to 8 minutes on one core, without the scores."""
STEPS = {"direct": 2000, "node": 900, "rnn": 1400, "occupancy-flow": 590, "odeform-per-point": 460}
ODEFORM_STEPS = {FRAMES[DROP][1]: 330, UNTIL[0]: 900, UNTIL[1]: 690}
"""Steps of `odeform` on the drop by number of frames. They took about `MINUTES` on one core of an AMD EPYC 7003, trials
and random features included. The time of a step of the per-point baselines (`STEPS`) does not depend on the frames."""
ROLLING_STEPS = {DROP: 60, "kick": 40}
"""Steps of `odeform-rolling`. They took 5 to 8 minutes of processor time: on the drop, more than other models have."""
KICK_STEPS = {"odeform": 3000, **{model: 3 * steps for model, steps in STEPS.items()}}
"""Steps on the kick, with three times the time of the drop."""
SUBSAMPLED_STEPS = {3: 240, 5: 180, 8: 120}
"""Steps of `odeform` on every 3rd, 5th or 8th frame of the drop: a step then takes more sequences."""


def plan(fraction: float = 1.0) -> dict[str, list[Run]]:
    """The runs of each table, with `fraction` of their steps."""
    tables = {
        "I": [_pushed(model) for model in ("odeform", *BASELINES)] + list(_each_object()),
        "II": [run for scene in BALLS for run in _unseen(scene)]
        + [_pushed(model) for model in ("odeform", *BASELINES, "pe-gnn")],
        "III": [*_extrapolation(), *(_pushed(model, PUSH[0]) for model in ("odeform", *BASELINES))],
        "IV": list(_interpolation()),
        "ablations": [
            replace(run, without=parts)
            for run in _ablated()
            for parts in ABLATED[run.model, run.scene]
            if run.seed == 0 or (run.model, run.scene, parts) != SEEDLESS
        ],
        "learning curve": list(_curve()),
    }
    return {
        table: [run if run.steps is None else replace(run, steps=max(round(fraction * run.steps), 1)) for run in runs]
        for table, runs in tables.items()
    }


def _steps(model: str, scene: str, frames: int, every: int = 1) -> int | None:
    if model in SOLVED:
        return None
    if model == OURS:
        return ROLLING_STEPS[scene]
    if scene == "kick":
        return KICK_STEPS[model]
    if model != "odeform":
        return STEPS[model]
    return ODEFORM_STEPS[frames] if every == 1 else SUBSAMPLED_STEPS[every]


def _whole(model: str, scene: str, seed: int = 0) -> Run:
    """Trained on all frames of all sequences."""
    scored = (FRAMES[scene], IMPACT) if scene == DROP else (FRAMES[scene],)
    return Run(model, scene, scored, _steps(model, scene, FRAMES[scene][1]), seed)


def _pushed(model: str, until: int | None = None) -> Run:
    """Trained on seven objects, on all frames or on the first `until`."""
    scored = SCORED_PUSHES.get(model, (FRAMES[FORCE],)) if until is None else (PUSH,)
    return Run(model, FORCE, scored, PUSH_STEPS.get(model), until=until)


def _each_object() -> Iterable[Run]:
    """`odeform` trained on one object at a time."""
    return [replace(_pushed("odeform"), scored=(FRAMES[FORCE],), objects=(name,)) for name in UNSEEN_OBJECTS]


def _unseen(scene: str) -> Iterable[Run]:
    """Table II: unseen parameters."""
    yield from (_whole(OURS, scene, seed) for seed in SEEDS)
    yield from (_whole(LATENT, scene, seed) for seed in (SEEDS if scene == DROP else SEEDS[:1]))
    yield from (_whole(model, scene) for model in (*BASELINES, "odeform-per-point"))


def _seeds() -> list[Run]:
    """`OURS` on all frames of the scenes of one ball, with all seeds."""
    return [_whole(OURS, scene, seed) for scene in reversed(BALLS) for seed in SEEDS]


def _ablated() -> list[Run]:
    return [*_seeds(), _whole(LATENT, DROP)]


def _curve() -> Iterable[Run]:
    """Trained on fewer sequences."""
    balls = [*_seeds(), *(_whole(model, scene) for scene in BALLS for model in SOLVED)]
    for run in [*balls, *(_pushed(model) for model in ("odeform", *SOLVED))]:
        yield run
        yield from (replace(run, sequences=count, scored=run.scored[:1]) for count in FEWER[run.scene])


def _extrapolation() -> Iterable[Run]:
    """Table III: frames after the trained ones."""
    for until in UNTIL:
        for model in (OURS, LATENT, *BASELINES):
            yield Run(model, DROP, ((until, until + AHEAD),), _steps(model, DROP, until), until=until)


def _interpolation() -> Iterable[Run]:
    """Table IV: all frames of the impact, by models trained on every frame and on every k-th.

    The k-th frames are staggered between sequences, or the same for all. `occupancy-flow` needs the second: it is given
    those frames at test time.
    """

    def subsampled(model: str, stagger: bool) -> Iterable[Run]:
        for every in INTERVALS:
            yield Run(model, DROP, (IMPACT,), _steps(model, DROP, FRAMES[DROP][1], every), every=every, stagger=stagger)

    for model in (OURS, LATENT, *BASELINES):
        yield _whole(model, DROP)
        yield from subsampled(model, stagger=True)
    for model in (OURS, LATENT, "pod-rbf", "occupancy-flow"):
        yield from subsampled(model, stagger=False)
