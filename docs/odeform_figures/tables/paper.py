"""The paper's figures (Tables I to V). Its data, bodies, simulator and machine differ from ours."""

__all__ = [
    "EXTRAPOLATED",
    "EXTRAPOLATED_FORCE",
    "IDENTIFIED",
    "INTERPOLATED",
    "UNSEEN",
    "UNSEEN_FORCE",
    "UNSEEN_OBJECTS",
]

UNSEEN = {
    "nODE": (10.344, 6.366, 205.0),
    "RNN": (13.585, 9.035, 260.0),
    "ODeform": (1.279, 0.948, 2.0),
}
"""Table II, Mass-Elastic: RMSE mm, MAE mm, MSE mm^2."""
UNSEEN_FORCE = {
    "nODE": (6.750, 4.956, 82.71),
    "RNN": (22.670, 16.076, 683.0),
    "PEGNN": (14.220, 9.837, 244.4),
    "ODeform": (6.657, 5.140, 58.43),
}
"""Table II, Contact-Force: RMSE mm, MAE mm, MSE mm^2."""
UNSEEN_OBJECTS = {
    "bottle": (7.322, 5.733, 65.0),
    "cat": (9.298, 7.203, 108.0),
    "dog": (10.617, 8.380, 128.0),
    "donut": (4.058, 3.000, 18.0),
    "chip": (4.842, 3.676, 26.0),
    "flip-flop": (5.760, 4.428, 39.0),
    "pillow": (4.705, 3.560, 25.0),
}
"""Table I, ODeform on Contact-Force, one network per object: RMSE mm, MAE mm, MSE mm^2."""
EXTRAPOLATED_FORCE = {"nODE": (10.926, 7.954), "RNN": (27.302, 20.107), "ODeform": (9.261, 7.051)}
"""Table III, Contact-Force: RMSE and MAE in mm."""
EXTRAPOLATED = {"nODE": (27.076, 16.208), "RNN": (28.718, 18.169), "ODeform": (3.597, 2.440)}
"""Table III, Mass-Elastic: RMSE and MAE in mm."""
INTERPOLATED = {
    "RNN": (27.19, 28.37, 39.17),
    "nODE": (24.56, 26.69, 26.59),
    "OccuFlow": (246.31, 244.42, 244.39),
    "ODeform": (3.67, 5.05, 9.47),
}
"""Table IV, Mass-Elastic: RMSE in mm from every 3rd, 5th and 8th frame."""
IDENTIFIED = {"mass": 0.113, "bending": 0.084}
"""Table V, Mass-Elastic: MAE in halves of the trained range."""
