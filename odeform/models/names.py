"""The names of all models, and where their classes are. Importing this module imports no model."""

__all__ = ["ALIASES", "MODELS", "TRAINABLE"]

MODELS: dict[str, str] = {
    "latent": "odeform.models.latent.model:LatentModel",
    "rolling": "odeform.models.rolling.model:RollingModel",
    "modal": "odeform.models.modal.model:ModalModel",
    "odeform-per-point": "odeform.models.points.odeform_per_point:OdeformPerPoint",
    "odeform-shapes": "odeform.models.points.shape_model:ShapeModel",
    "node": "odeform.models.points.node:Node",
    "rnn": "odeform.models.points.rnn:Rnn",
    "direct": "odeform.models.points.direct:Direct",
    "pe-gnn": "odeform.models.points.pe_gnn:PeGnn",
    "occupancy-flow": "odeform.models.points.occupancy_flow:OccupancyFlow",
    "pod-rbf": "odeform.models.baselines.pod_rbf:PodRbf",
    "gp": "odeform.models.baselines.gp:GaussianProcess",
    "nearest": "odeform.models.baselines.nearest:Nearest",
    "released": "odeform.models.authors.predictor:AuthorsModel",
    "clamped": "odeform.models.clamped:ClampedModel",
}
"""Name in checkpoints and on the command line -> "module:class"."""

ALIASES = {"odeform": "latent", "odeform-rolling": "rolling", "odeform-mechanical": "modal"}
"""Names that older checkpoints and commands have for the three families of ODeform."""

TRAINABLE = tuple(name for name in (*MODELS, *ALIASES) if name not in ("released", "clamped", "odeform-mechanical"))
"""The models that `odeform train` trains. The authors' network and the clamped body, of which nothing is learned, are
only read; `odeform` is the family that suits the data: modal in scenes with objects, latent in all others."""
