"""How punctual the node is, measured on nodes in processes of their own."""

from __future__ import annotations

from collections.abc import Mapping

from xb_muscle_ros.bench.measure import Figure, Setting, counting_down
from xb_muscle_ros.bench.roundtrip import run_roundtrip
from xb_muscle_ros.bench.timing import run_beside_plain_timer, run_timing

# Messages per second where nothing else is asked for.
_NODE_HZ, _MESSAGES_HZ = 1000.0, 500.0


def realtime(setting: Setting) -> list[Figure]:
    """Lateness, overruns and processor share of a realtime node, beside a plain timer's at the same time.

    Raises:
        UserError: a node does not start or stops early.
    """
    duration_s, rate_hz = setting.duration_s, setting.rate_hz or _NODE_HZ
    with counting_down(duration_s, "node"):
        ours, plain = run_beside_plain_timer(duration_s, rate_hz, settings=_parameters(setting))
    name = f"{_prioritised('node', setting)}, {rate_hz:g} Hz for {duration_s:g} s"
    return _of_ticks(name, ours, rate_hz) + _of_ticks(f"plain timer beside {name}", plain, rate_hz)


def roundtrip(setting: Setting) -> list[Figure]:
    """From length message to force message and back, with nodes of one fibre and of many in lockstep.

    Raises:
        UserError: see `realtime`.
    """
    duration_s, rate_hz, made = setting.duration_s, setting.rate_hz or _MESSAGES_HZ, []
    with counting_down(2.0 * duration_s, "round trip"):
        for fibres in (1, setting.fibres):
            found = run_roundtrip(duration_s, rate_hz, fibres=fibres)
            made += _of_answers(f"round trip, {_counted(fibres)}, {rate_hz:g} Hz for {duration_s:g} s", found)
    return made


def many(setting: Setting) -> list[Figure]:
    """A node of many fibres in realtime, after one of one fibre, and in lockstep as fast as it answers.

    Raises:
        UserError: see `realtime`.
    """
    duration_s, rate_hz, fibres, made = setting.duration_s, setting.rate_hz or _NODE_HZ, setting.fibres, []
    with counting_down(3.0 * duration_s, f"{fibres} fibres"):
        for count in (1, fibres):
            name = _prioritised(f"{_counted(count)} in realtime, {rate_hz:g} Hz for {duration_s:g} s", setting)
            found = run_timing(duration_s, rate_hz, fibres=count, settings=_parameters(setting))
            made += _of_ticks(name, found, rate_hz)
        lockstep = run_roundtrip(duration_s, None, fibres=fibres, calcium_every=1)
    name = f"{_counted(fibres)} in lockstep, length and calcium one after the other for {duration_s:g} s"
    return [*made, *_of_answers(name, lockstep)]


def _counted(fibres: int) -> str:
    return "one fibre" if fibres == 1 else f"{fibres} fibres"


def _parameters(setting: Setting) -> Mapping[str, object]:
    return {"realtime_priority": setting.priority, "lock_memory": setting.priority > 0}


def _prioritised(name: str, setting: Setting) -> str:
    return f"{name} (SCHED_FIFO {setting.priority})" if setting.priority else name


_PERCENTILES = ("p50", "p99", "p99.9", "max")


def _of_ticks(name: str, found: Mapping[str, float], rate_hz: float) -> list[Figure]:
    late = f"the tick's deadline; load {found['load']:.1f}"
    due = f"{found['seconds'] * rate_hz:.0f} due in {found['seconds']:.2f} s"
    dropped = f"{found['dropped_ticks']:.0f}"
    return [
        *(Figure(f"{name}, lateness {key}", found[f"lateness_{key}_us"], "µs", late) for key in _PERCENTILES),
        Figure(f"{name}, ticks", found["ticks"], "1", f"and {dropped} dropped; {due}"),
        Figure(f"{name}, overruns", found["overruns"], "1", f"of them dropped {dropped}"),
        Figure(f"{name}, state violations", found["state_violations"], "1", "0"),
        Figure(f"{name}, processor", 100.0 * found["cpu_share"], "%", "of one core"),
    ]


def _of_answers(name: str, found: Mapping[str, float]) -> list[Figure]:
    return [
        *(Figure(f"{name}, {key}", found[f"{key}_us"], "µs", f"load {found['load']:.1f}") for key in _PERCENTILES),
        Figure(f"{name}, first quarter", found["first_us"], "µs", f"median; {found['last_us']:.0f} µs in the last"),
        Figure(f"{name}, rate", found["rate_hz"], "Hz", f"{found['behind']:.0f} messages a period late"),
        Figure(f"{name}, forces unlike those without ROS", found["unequal"], "1", f"0 of {found['forces']:.0f}"),
        Figure(f"{name}, processor", 100.0 * found["cpu_share"], "%", "of one core, the node"),
    ]
