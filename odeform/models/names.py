"""The names of all models, and where their classes are. Importing this module imports no model."""

__all__ = ["MODELS", "TRAINABLE"]

MODELS: dict[str, str] = {
    "odeform": "odeform.models.odeform.model:ODeform",
    "odeform-mechanical": "odeform.models.mechanical.model:MechanicalODeform",
    "odeform-rolling": "odeform.models.rolling.model:RollingODeform",
    "odeform-per-point": "odeform.models.baselines.odeform_per_point:OdeformPerPoint",
    "node": "odeform.models.baselines.node:Node",
    "rnn": "odeform.models.baselines.rnn:Rnn",
    "direct": "odeform.models.baselines.direct:Direct",
    "pe-gnn": "odeform.models.baselines.pe_gnn:PeGnn",
    "occupancy-flow": "odeform.models.baselines.occupancy_flow:OccupancyFlow",
    "pod-rbf": "odeform.models.baselines.pod_rbf:PodRbf",
    "gp": "odeform.models.baselines.gp:GaussianProcess",
    "nearest": "odeform.models.baselines.nearest:Nearest",
    "released": "odeform.models.authors.predictor:AuthorsModel",
}
"""Name in checkpoints and on the command line -> "module:class"."""

TRAINABLE = tuple(name for name in MODELS if name not in ("released", "odeform-mechanical"))
"""The models that `odeform train` trains. The authors' network is only read; `odeform` becomes `odeform-mechanical` in
scenes with objects."""
