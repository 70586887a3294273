from odeform.benchmark.report import report

EMPTY = {
    "model": "nearest",
    "scene": "kick",
    "data": None,
    "machine": {"cores": 2, "processor": "x", "load": 0.5},
    "latency": {"points": 10},
    "limits": {"memory_gb_s": 1.0},
    "scaling": [],
    "peers": {},
}


def test_a_dash_is_explained() -> None:
    assert "not measured" not in report(EMPTY)
    assert report({**EMPTY, "limits": {"memory_gb_s": None}}).splitlines()[-1] == "-: not measured"


def test_motions_in_one_call_stand_beside_a_loop() -> None:
    batch = {"motions": 256, "ms_a_motion": 1.5, "loop_ms_a_motion": 6.0}
    text = report({**EMPTY, "batch": batch})
    assert "motions  ms_a_motion  loop_ms_a_motion" in text
    assert "    256          1.5                 6" in text
