from odeform.benchmark.report import report


def test_a_dash_is_explained() -> None:
    result = {
        "model": "nearest",
        "scene": "kick",
        "data": None,
        "machine": {"cores": 2, "processor": "x", "load": 0.5},
        "latency": {"points": 10},
        "limits": {"memory_gb_s": 1.0},
        "scaling": [],
        "peers": {},
    }
    assert "not measured" not in report(result)
    assert report({**result, "limits": {"memory_gb_s": None}}).splitlines()[-1] == "-: not measured"
