"""Files of single frames say what has to be known of the motion, and are read as if they did not."""

from pathlib import Path

import numpy as np
import pytest

from odeform.formats.reading import read_geometry
from odeform.formats.writing import write_motion, write_shape
from odeform.models.base import Predictor
from odeform.types import Mesh

LATE = b"outside the trained window, 0 to 1 s"


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".glb", ".stl"])
def test_a_frame_after_the_window_says_so(kick: Predictor, tmp_path: Path, suffix: str) -> None:
    motion = kick.solve()
    write_motion(motion, np.array([0.5, 1.2]), tmp_path / f"{{frame}}{suffix}")
    first, late = (tmp_path / f"0000{index}{suffix}" for index in range(2))
    assert LATE not in first.read_bytes()
    assert b"t = 1.2 s is " + LATE in late.read_bytes()
    write_shape(Mesh(motion.vertices(1.2), kick.rest.faces), tmp_path / f"plain{suffix}")
    said, plain = read_geometry(late), read_geometry(tmp_path / f"plain{suffix}")
    assert isinstance(said, Mesh)
    assert isinstance(plain, Mesh)
    assert np.array_equal(said.points, plain.points)
    assert np.array_equal(said.faces, plain.faces)


def test_several_notes_with_letters_beyond_ascii(kick: Predictor, tmp_path: Path) -> None:
    notes = ("one", "two\nlines of a größere Form")
    for suffix in (".ply", ".obj", ".glb", ".stl"):
        write_shape(kick.rest, tmp_path / f"noted{suffix}", notes)
        read = read_geometry(tmp_path / f"noted{suffix}")
        assert len(read.points) == len(kick.rest.points)
    assert b"comment one\ncomment two lines of a gr??ere Form\n" in (tmp_path / "noted.ply").read_bytes()
