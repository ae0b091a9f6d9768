"""How punctual the node is, measured on nodes in processes of their own."""

from __future__ import annotations

from xb_muscle_ros.bench.measure import Figure


def figures(duration_s: float, rate_hz: float, priority: int = 0) -> list[Figure]:
    """Lateness, overruns and processor share of a realtime node, beside a plain timer's at the same time.

    Args:
        duration_s, rate_hz: of the run, s and Hz.
        priority: of the node, ``realtime_priority``; the plain timer has none.

    Raises:
        UserError: a node does not start or stops early.
    """
    from xb_muscle_ros.bench.timing import run_beside_plain_timer

    settings = {"realtime_priority": priority, "lock_memory": priority > 0}
    ours, plain = run_beside_plain_timer(duration_s, rate_hz, settings=settings)
    name = f"{_prioritised('node', priority)}, {rate_hz:g} Hz for {duration_s:g} s"
    return _of_ticks(name, ours, rate_hz) + _of_ticks(f"plain timer beside {name}", plain, rate_hz)


def roundtrip_figures(duration_s: float, rate_hz: float) -> list[Figure]:
    """From length message to force message and back, with a node in lockstep.

    Raises:
        UserError: see `figures`.
    """
    from xb_muscle_ros.bench.timing import run_roundtrip

    return _of_answers(f"round trip, {rate_hz:g} Hz for {duration_s:g} s", run_roundtrip(duration_s, rate_hz))


def many_figures(duration_s: float, rate_hz: float, fibres: int, priority: int = 0) -> list[Figure]:
    """A node of many fibres, in realtime and then in lockstep.

    Raises:
        UserError: see `figures`.
    """
    from xb_muscle_ros.bench.timing import run_roundtrip, run_timing

    name = f"{fibres} fibres, {rate_hz:g} Hz for {duration_s:g} s"
    settings = {"realtime_priority": priority, "lock_memory": priority > 0}
    realtime = run_timing(duration_s, rate_hz, fibres=fibres, settings=settings)
    lockstep = run_roundtrip(duration_s, rate_hz, fibres=fibres)
    return _of_ticks(_prioritised(name, priority), realtime, rate_hz) + _of_answers(f"{name}, round trip", lockstep)


def _prioritised(name: str, priority: int) -> str:
    return f"{name} (SCHED_FIFO {priority})" if priority else name


def _of_ticks(name: str, result: dict[str, float], rate_hz: float) -> list[Figure]:
    load = f"load {result['load']:.1f}"
    made = [
        Figure(f"{name}, lateness {key}", result[f"lateness_{key}_us"], "µs", None, f"the tick's deadline; {load}")
        for key in ("p50", "p99", "p99.9", "max")
    ]
    due = f"{result['seconds'] * rate_hz:.0f} due in {result['seconds']:.2f} s"
    return [
        *made,
        Figure(
            f"{name}, ticks",
            result["ticks"],
            "1",
            None,
            f"and {result['dropped_ticks']:.0f} dropped; {due}",
        ),
        Figure(f"{name}, overruns", result["overruns"], "1", None, f"of them dropped {result['dropped_ticks']:.0f}"),
        Figure(f"{name}, state violations", result["state_violations"], "1", None, "0"),
        Figure(f"{name}, processor", 100.0 * result["cpu_share"], "%", None, "of one core"),
    ]


def _of_answers(name: str, result: dict[str, float]) -> list[Figure]:
    load = f"load {result['load']:.1f}"
    made = [Figure(f"{name}, {key}", result[f"{key}_us"], "µs", None, load) for key in ("p50", "p99", "p99.9", "max")]
    trend = f"{result['last_us']:.0f} µs in the last"
    return [
        *made,
        Figure(f"{name}, first quarter", result["first_us"], "µs", None, f"median; {trend}"),
        Figure(f"{name}, rate", result["rate_hz"], "Hz", None, f"{result['behind']:.0f} messages a period late"),
        Figure(f"{name}, processor", 100.0 * result["cpu_share"], "%", None, "of one core, the node"),
    ]
