"""How punctual the node is in realtime mode, measured on a node in a process of its own."""

from __future__ import annotations

from xb_muscle_ros.bench.measure import Figure


def figures(duration_s: float, rate_hz: float) -> list[Figure]:
    """Lateness, overruns and processor share of a node that is fed length and calcium over DDS.

    Raises:
        UserError: the node does not start or stops early.
    """
    from xb_muscle_ros.node.timing import run_timing

    result = run_timing(duration_s, rate_hz)
    name = f"node, {rate_hz:g} Hz for {duration_s:g} s"
    made = []
    for key in ("p50", "p99", "p99.9", "max"):
        value = float(result[f"lateness_{key}_us"])
        made.append(Figure(f"{name}, lateness {key}", value, "µs", None, "the tick's absolute deadline"))
    ticks = float(result["ticks"])
    made.append(Figure(f"{name}, ticks", ticks, "1", None, f"{duration_s * rate_hz:.0f} due"))
    made.append(Figure(f"{name}, overruns", float(result["overruns"]), "1", None, "0: no tick left out"))
    made.append(Figure(f"{name}, state violations", float(result["state_violations"]), "1", None, "0"))
    made.append(Figure(f"{name}, processor", 100.0 * float(result["cpu_share"]), "%", None, "of one core"))
    return made
