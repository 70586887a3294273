import numpy as np
import pytest

from odeform.models.registry import load
from odeform_figures.studies.modal_parts import without_parts


def test_parts_that_are_left_out_change_the_motion_and_leave_the_model() -> None:
    modal = load("contact-force")
    given, time = {"object": "chip"}, 0.1
    whole = modal.solve(parameters=given).vertices(time)
    fitted, bare = (without_parts(modal, fitted).solve(parameters=given).vertices(time) for fitted in (True, False))
    assert np.abs(fitted - whole).max() > 1e-5
    assert np.abs(fitted - bare).max() > 1e-5
    np.testing.assert_array_equal(modal.solve(parameters=given).vertices(time), whole)


def test_other_models_have_no_such_parts() -> None:
    with pytest.raises(TypeError, match="several objects"):
        without_parts(load("kick"), fitted=True)
    with pytest.raises(TypeError, match="modal"):
        without_parts(load("contact-force/gp"), fitted=True)
