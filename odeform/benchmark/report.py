"""The result of `odeform bench` as text."""

from collections.abc import Mapping, Sequence
from typing import Any

__all__ = ["report"]

SIMULATED = ("simulator_s", "speedup", "skipped")


def report(result: Mapping[str, Any]) -> str:
    """Writes tables of all measurements."""
    machine = result["machine"]
    lines = [
        f"{result['model']} of {result['scene']} on {machine['cores']} cores of {machine['processor']}; load average "
        f"at the start {_cell(machine['load'])}; data: {result['data'] or 'none'}"
    ]
    for part in (_objects,) if "objects" in result else (_latency, _solver, _speed, _comparisons):
        lines += part(result)
    if batch := result.get("batch"):
        title = "motions that are solved in one call, beside a loop, with their vertices at four times"
        lines += _table(title, [batch], ("motions", "ms_a_motion", "loop_ms_a_motion"))
    if any("-" in line.split() for line in lines):
        lines += ["", "-: not measured"]
    return "\n".join(lines)


def _objects(result: Mapping[str, Any]) -> list[str]:
    found = result["objects"]
    columns = ("object", "quality", "points", "steps", "ms_p50", "ms_p95", "first_ms", "frame_ms", "solver_error_mm")
    title = f"a new motion of {found['sequences']} pushes of the test split: a trajectory and all of its frames"
    lines = _table(title, found["qualities"], (*columns, "model_error_mm"))
    return lines + _table("the simulator, beside the default quality", found["simulator"], ("object", *SIMULATED))


def _latency(result: Mapping[str, Any]) -> list[str]:
    latency = result["latency"]
    stages = [{"stage": key, **value} for key, value in latency.items() if isinstance(value, Mapping)]
    return _table(f"latency at {latency['points']} points, ms", stages, ("stage", "p50", "p95"))


def _solver(result: Mapping[str, Any]) -> list[str]:
    """Empty for a model without a solver."""
    lines, columns = [], ("at", "solver", "setting", "dtype", "evaluations", "ms_p50", "ms_p95", "solver_error_mm")
    if "qualities" in result:
        rows = [{**row, "at": name, "setting": _setting(row)} for name, row in result["qualities"].items()]
        lines += _table("qualities, at the default parameters", rows, columns)
        for name, point in result["places"].items():
            rows = [{**row, "setting": _setting(row)} for row in result["work_precision"] if row["at"] == name]
            title = (
                f"work and precision at the {name}: model error {_cell(point['model_error_mm'])} mm on "
                f"{len(point['model_error_on'])} nearby test sequences, reference converged to "
                f"{point['reference_unsure_mm']:.1g} mm"
            )
            lines += _table(title, rows, columns[1:])
    if result.get("frontier"):
        rows = [{**row, "setting": _setting(row)} for row in result["frontier"]]
        columns = ("method", "setting", "evaluations", "ms", "solver_error_mm")
        lines += _table("frontier (validation split)", rows, columns)
    return lines


def _speed(result: Mapping[str, Any]) -> list[str]:
    rows = [{"limit": key, "measured": value} for key, value in result["limits"].items()]
    lines = _table("roofline: limits of this machine", rows, ("limit", "measured"))
    return lines + _table("scaling, per frame", result["scaling"], ("points", "solve_ms", "basis_ms", "decode_ms"))


def _comparisons(result: Mapping[str, Any]) -> list[str]:
    rows = [{"compared": name, **row} for name, row in result["peers"].items()]
    measured = [row for row in rows if "skipped" not in row]
    columns = ("compared", "points", "frames", "ms", "ours_ms", "speedup", "error_mm")
    lines = _table("comparisons", measured, columns)
    lines += [f"{row['compared']}: skipped, {row['skipped']}" for row in rows if "skipped" in row]
    if "tried" in (simulator := result["peers"].get("mujoco, equal error", {})):
        title = (
            f"simulator settings; this model's error on the same {len(simulator['sequences'])} sequences is "
            f"{simulator['ours_error_mm']:.3g} mm, and it pays off after {simulator['pays_off_after']} queries"
        )
        lines += _table(title, simulator["tried"], ("step", "segments", "ms", "error_mm", "failed"))
    return lines


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _table(title: str, rows: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> list[str]:
    cells = [list(columns), *([_cell(row.get(column)) for column in columns] for row in rows)]
    widths = [max(len(line[i]) for line in cells) for i in range(len(columns))]
    lines = ["  ".join(cell.rjust(width) for cell, width in zip(line, widths, strict=True)) for line in cells]
    return ["", title, *lines]


def _setting(row: Mapping[str, Any]) -> str:
    return f"h = {1e3 * row['step']:.3g} ms" if "step" in row else f"tol {row['tolerance']:.0e}"
