"""What models and scenes are called where people read of them."""

from odeform.loads.registry import load_of_scene

__all__ = ["family_title", "subject_of"]

FAMILIES = {
    "odeform": "ODeform",
    "odeform-rolling": "ODeform (rolling ball)",
    "latent": "ODeform",
    "rolling": "ODeform (rolling ball)",
    "modal": "ODeform (elastic body)",
    "odeform-per-point": "ODeform per point",
    "odeform-shapes": "ODeform, one network",
    "gp": "kernel regression",
    "pod-rbf": "POD + RBF",
    "nearest": "nearest training motion",
    "node": "neural ODE per point",
    "rnn": "recurrent network",
    "direct": "direct network",
    "pe-gnn": "graph network",
    "occupancy-flow": "occupancy flow",
    "released": "authors' network",
    "clamped": "clamped body",
}
SCENES = {"kick": "ball, kicked", "mass-elastic": "ball, dropped", "clamped": "clamped body, let go"}


def family_title(family: str) -> str:
    """What a family of models is called; plugged ones keep their own names."""
    return FAMILIES.get(family, family)


def subject_of(scene: str, body: str) -> str:
    """What is seen, such as "donut, thrown"; `body` is empty where the scene has one only."""
    if not body:
        return SCENES.get(scene, scene)
    load = load_of_scene(scene)
    what = "pushed" if load is None else load.happened or load.title.lower()
    return f"{body}, {what}"
