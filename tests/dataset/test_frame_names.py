"""The order of frames by the values in their names, and what is refused because it would stretch or shift the clock."""

from pathlib import Path

import pytest

from odeform.dataset.importers.frame_names import numbered_frames
from odeform.errors import InputError

ORDERED = {
    "values": "f_8 f_9 f_10 f_11",
    "padded (Blender)": "cloth_000001 cloth_000002 cloth_000003",
    "partly padded": "f_08 f_09 f_10 f_11",
    "Houdini's $F4": "geo.0001 geo.0002 geo.0003",
    "steps": "f_0 f_5 f_10 f_15",
    "from any number": "f_1001 f_1002 f_1003",
    "bare": "0 1 2 3",
    "bare and negative": "-1 0 1",
    "brackets": "f (1) f (2) f (3)".replace(" (", "("),
    "negative": "frame_-3 frame_-2 frame_-1 frame_0 frame_1",
    "negative behind a point": "frame.-1 frame.0 frame.1",
    "negative behind a minus": "frame--2 frame--1 frame-0 frame-1",
    "negative without a separator": "f-2 f-1 f0 f1",
    "minus as a separator": "Result-1 Result-2 Result-3",
    "decimals": "m_0 m_0.1 m_0.25 m_0.5 m_0.75 m_1",
    "decimals behind a minus (Kratos)": "Result-0.0005 Result-0.001 Result-0.0015 Result-0.002",
    "decimals as Python prints them": "m_0.0 m_0.1 m_0.2 m_0.30000000000000004 m_0.4",
    "negative decimals": "t=-0.5 t=0 t=0.5",
    "decimals without a zero": "m_.25 m_.5 m_.75",
    "decimal commas": "m_0,1 m_0,2 m_0,3",
    "exponents": "m_0 m_1e-3 m_2e-3 m_3e-3",
    "exponents of MATLAB": "m_1.0e-03 m_2.0e-03 m_3.0e-03",
    "exponents among decimals": "m_0 m_5e-05 m_0.0001 m_0.00015",
    "no exponents": "s01e08 s01e09 s01e10",
    "no exponents either": "case2e-001 case2e-002 case2e-003",
    "rounded times": "m_0.000 m_0.033 m_0.067 m_0.100 m_0.133",
    "constant numbers": "take2_v3_1 take2_v3_2 take2_v3_3",
    "a point that separates": "shot.1.8 shot.1.9 shot.1.10 shot.1.11",
    "version and padded number": "v1.0009 v1.0010 v1.0011",
    "index and time": "f_0001_t0.05 f_0002_t0.1 f_0003_t0.15",
    "time stamp and index": "20240105120001123456_0001 20240105120001123999_0002 20240105120001124000_0003",
    "long time stamps": "20240105120001123456 20240105120001123457 20240105120001123458",
    "letters of both cases": "F_1 f_2 F_3",
    "signs": "f_+1 f_+2 f_+3",
    "two frames": "f_3 f_9",
}


def test_numbers_may_be_padded_by_spaces() -> None:
    padded = [Path(f"f {number:3}.obj") for number in (8, 9, 10, 100)]
    with pytest.raises(InputError, match="frames 11 to 99 are missing"):
        numbered_frames(padded, "here")
    assert numbered_frames(padded[2::-1], "here").files == tuple(padded[:3])
    with pytest.raises(InputError, match="are both frame 8"):
        numbered_frames([*padded[:3], Path("f 8.obj")], "here")


@pytest.mark.parametrize("name", ORDERED)
def test_frames_are_ordered_by_value(name: str) -> None:
    names = ORDERED[name].split()
    shuffled = [Path(f"{stem}.obj") for stem in sorted(names, reverse=True)]
    assert [path.stem for path in numbered_frames(shuffled, "here").files] == names


REFUSED = {
    "a gap": ("f_0 f_1 f_3", "frame 2 is missing between f_1.obj and f_3.obj; .*times.csv"),
    "a long gap": ("f_0 f_1 f_7 f_8", "frames 2 to 6 are missing between f_1.obj and f_7.obj"),
    "an immense gap": ("f_0 f_1 f_2 f_1000000000000000000", "frames 3 to .* are missing"),
    "a gap in steps": ("f_0 f_10 f_20 f_40", "frame 30 is missing between f_20.obj and f_40.obj"),
    "a gap below zero": ("f_-3 f_-1 f_0 f_1", "frame -2 is missing"),
    "a gap at zero": ("t_-0.2 t_-0.1 t_0.1 t_0.2", "frame 0 is missing between t_-0.1.obj and t_0.1.obj"),
    "a gap in decimals": ("m_0.0 m_0.1 m_0.2 m_0.4 m_0.5", "frame 0.3 is missing between m_0.2.obj and m_0.4.obj"),
    "a gap in rounded decimals": (
        "m_0.000 m_0.033 m_0.067 m_0.133 m_0.167",
        "frame 0.1.* between m_0.067.obj",
    ),
    "an odd last frame": ("f_0 f_5 f_10 f_12", "equal steps, got f_10.obj and f_12.obj, 2 apart, among steps of 5"),
    "padded and unpadded": ("f_1 f_01 f_2", "f_1.obj and f_01.obj are both frame 1"),
    "integer and decimal": ("f_1 f_1.0 f_2", "f_1.obj and f_1.0.obj are both frame 1"),
    "decimal and exponent": ("f_0.001 f_1e-3 f_0.002", "are both frame 0.001"),
    "copies of Windows": ("f_0|f_1 (1)|f_1|f_2 - Copy|f_2", r"got also f_1 \(1\).obj, f_2 - Copy.obj: copies"),
    "copies of macOS": ("f_0|f_1|f_1 copy|f_2|f_2 copy 2", "got also f_1 copy.obj, f_2 copy 2.obj"),
    "copies of German Windows": ("f_0|f_1|f_1 - Kopie|f_2", "got also f_1 - Kopie.obj"),
    "copies, named first": ("f_0|f_1|Copy of f_1|Kopie von f_2|f_2", "got also Copy of f_1.obj, Kopie von f_2.obj"),
    "all copied": ("f_0|f_0 (1)|f_1|f_1 (1)", "expected one sequence"),
    "backups": ("f_0|f_1|~f_1|f_2", "got also ~f_1.obj"),
    "two sequences": ("a_0 a_1 a_2 b_0 b_1", "got also b_0.obj, b_1.obj: copies, or frames of another sequence"),
    "many others": ("a_0 a_1 a_2 b_0 b_1 c_0 c_1 d_0", "and 1 more"),
    "a first frame without a number": ("mesh mesh.001 mesh.002", "got also mesh.obj"),
    "a shape at rest": ("rest f_1 f_2", "got also rest.obj"),
    "no numbers": ("first last", "expected one sequence"),
    "steps and frames": ("Step-1-Frame-0 Step-1-Frame-1 Step-2-Frame-0", "one number that counts .*got 2 that vary"),
    "decimals with a letter": ("t0p25 t0p5 t1p0", "got 2 that vary"),
    "far beyond all times": ("f_1e-99999999999999999999 f_2e-3", "plausible size"),
    "beyond all times": ("f_1e+999 f_2e+999", r"plausible size, got 1e\+999"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_would_change_the_clock_is_refused(name: str) -> None:
    names, message = REFUSED[name]
    stems = names.split("|") if "|" in names else names.split()
    with pytest.raises(InputError, match=f"here: .*{message}"):
        numbered_frames([Path(f"{stem}.obj") for stem in stems], "here")


def test_even_numbers_have_a_step_and_uneven_decimals_none() -> None:
    def step(names: str) -> float | None:
        return numbered_frames([Path(f"{name}.obj") for name in names.split()], "here").step

    assert step("f_2 f_4 f_6") == 2.0
    assert step("m_0.1 m_0.2 m_0.30000000000000004") == pytest.approx(0.1)
    assert step(ORDERED["rounded times"]) == pytest.approx(1 / 30, rel=1e-2)
    assert step(ORDERED["decimals"]) is None
    assert step("m_0.0 m_0.013 m_0.0291 m_0.05") is None
