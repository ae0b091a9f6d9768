"""What a run of the loop says: numbers, a table, and files."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.files import write_json
from xb_muscle_ros.plant.loop import Trace
from xb_muscle_ros.tables import Filled, aligned, number, write_csv

STIFFNESS_AT_S = (0.02, 0.05, 0.1)
_FIRST_S = 0.1


def numbers(trace: Trace) -> dict[str, float | None]:
    """Scores of one run; None where the run is too short for one, or the leg does not turn."""
    return ankle_numbers(trace) if trace.scene == "ankle" else knee_numbers(trace)


def _index(trace: Trace, time_s: float) -> int | None:
    """Row of a time, None if the run ends before."""
    at = int(np.searchsorted(trace.time_s, time_s - 1e-9))
    return at if at < trace.time_s.size else None


def _change(trace: Trace, values: Any, time_s: float) -> float | None:
    """Change of values, shape (n,), from the start to a time."""
    at = _index(trace, time_s)
    return None if at is None else float(values[at] - values[0])


def ankle_numbers(trace: Trace) -> dict[str, float | None]:
    """Force, chordal stiffness and sway of the standing scene.

    Chordal stiffness is the change of the muscles' torque over the change of the angle since the start, as a share of
    m·g·h; below 1 the body falls however slowly it moves. It contains what velocity adds.
    """
    first = trace.time_s <= _FIRST_S + 1e-9
    found: dict[str, float | None] = {
        "force_at_rest_n": float(trace.force_n[0, 0]),
        "peak_force_rise_100ms_n": float(np.max(trace.force_n[first, 0] - trace.force_n[0, 0])),
    }
    for time_s in (0.01, *STIFFNESS_AT_S):
        found[f"force_rise_{1000 * time_s:.0f}ms_n"] = _change(trace, trace.force_n[:, 0], time_s)
    for time_s in STIFFNESS_AT_S:
        torque, angle = _change(trace, trace.torque_nm, time_s), _change(trace, trace.angle_rad, time_s)
        usable = torque is not None and angle is not None and abs(angle) > 1e-9
        stiffness = torque / angle if usable and torque is not None and angle is not None else None
        name = f"stiffness_{1000 * time_s:.0f}ms"
        found[f"{name}_nm_per_rad"] = stiffness
        found[f"{name}_mgh"] = None if stiffness is None else stiffness / trace.load_nm_per_rad
    for time_s in (0.1, 0.3):
        sway = _change(trace, trace.angle_rad, time_s)
        found[f"sway_{1000 * time_s:.0f}ms_deg"] = None if sway is None else math.degrees(sway)
    return found


def knee_numbers(trace: Trace) -> dict[str, float | None]:
    """First swing of the pendulum test, and force and angle on the way."""
    angle = np.degrees(trace.angle_rad)
    first = trace.time_s <= _FIRST_S + 1e-9
    back = np.flatnonzero(np.diff(angle) < 0.0)
    turned = int(back[0]) if back.size else None
    found: dict[str, float | None] = {
        "force_at_rest_n": float(trace.force_n[0, 0]),
        "peak_force_rise_100ms_n": float(np.max(trace.force_n[first, 0] - trace.force_n[0, 0])),
        "least_force_n": float(np.min(trace.force_n[:, 0])),
        "first_swing_excursion_deg": None if turned is None else float(angle[turned] - angle[0]),
        "first_swing_s": None if turned is None else float(trace.time_s[turned]),
        "last_angle_deg": float(angle[-1]),
    }
    for time_s in (0.1, 0.3):
        found[f"angle_{1000 * time_s:.0f}ms_deg"] = _change(trace, angle, time_s)
    return found


_COLUMNS = {
    "ankle": (
        ("force_at_rest_n", "force [N]", ".0f"),
        ("force_rise_20ms_n", "rise 20 ms [N]", ".1f"),
        ("force_rise_50ms_n", "50 ms [N]", ".1f"),
        ("peak_force_rise_100ms_n", "peak to 100 ms [N]", ".1f"),
        ("stiffness_20ms_mgh", "stiffness 20 ms [mgh]", ".2f"),
        ("stiffness_50ms_mgh", "50 ms [mgh]", ".2f"),
        ("stiffness_100ms_mgh", "100 ms [mgh]", ".2f"),
        ("sway_100ms_deg", "sway 100 ms [deg]", ".3f"),
        ("sway_300ms_deg", "300 ms [deg]", ".3f"),
    ),
    "knee": (
        ("force_at_rest_n", "force [N]", ".0f"),
        ("peak_force_rise_100ms_n", "peak rise to 100 ms [N]", ".1f"),
        ("angle_100ms_deg", "angle 100 ms [deg]", ".2f"),
        ("angle_300ms_deg", "300 ms [deg]", ".2f"),
        ("first_swing_excursion_deg", "first swing [deg]", ".1f"),
        ("first_swing_s", "lasts [s]", ".2f"),
        ("last_angle_deg", "last angle [deg]", ".1f"),
    ),
}


def rows(traces: Sequence[Trace]) -> Filled:
    """The main numbers as text: heads, and a row for each run."""
    columns = _COLUMNS[traces[0].scene]
    made = []
    for trace in traces:
        found = numbers(trace)
        made.append([trace.label, *(number(found[key], form) for key, _, form in columns)])
    return ["model", *(head for _, head, _ in columns)], made


def table(traces: Sequence[Trace]) -> str:
    """`rows` as aligned text."""
    return aligned(*rows(traces))


def write(out: Path, traces: Sequence[Trace], settings: dict[str, object]) -> list[Path]:
    """Write ``loop.json`` (settings and numbers) and ``loop.csv`` (traces); the same runs give the same bytes."""
    runs = [
        {
            "model": trace.model,
            "moved_before": trace.moved_before,
            "reflex": trace.reflex,
            "fibre": trace.fibre or None,
            # MuJoCo's own muscle is driven by activation, 0 to 1, the fibre's models by free calcium.
            **trace.driven_by,
            "start_acceleration_rad_per_s2": trace.start_acceleration_rad_per_s2,
            "ended_before_its_time": trace.ended or None,
            "beyond_lengths": trace.beyond or None,
            "numbers": numbers(trace),
        }
        for trace in traces
    ]
    tree = {"scene": traces[0].scene, **settings, "load_nm_per_rad": traces[0].load_nm_per_rad, "runs": runs}
    write_json(out / "loop.json", tree)
    write_csv(out / "loop.csv", _samples(traces))
    return [out / "loop.json", out / "loop.csv"]


def _samples(traces: Sequence[Trace]) -> Iterator[dict[str, Any]]:
    """Long format: a row for each run and tick."""
    columns = [f"{m}.{what}" for what in ("force_n", "length_change_l0") for m in traces[0].muscles]
    names = ["model", "time_s", "angle_rad", "torque_nm", *columns]
    drives = list(dict.fromkeys(kind for trace in traces for kind in trace.driven_by))
    varies = any(trace.reflex for trace in traces)
    for trace in traces:
        data = (trace.time_s, trace.angle_rad, trace.torque_nm, trace.force_n, trace.length_change_l0)
        for row, levels in zip(np.column_stack(data).tolist(), trace.level.tolist(), strict=True):
            made = dict(zip(names, [trace.label, *row], strict=True))
            for kind in drives if varies else ():
                own = levels if kind in trace.driven_by else [None] * len(levels)
                made.update({f"{m}.{kind}": level for m, level in zip(trace.muscles, own, strict=True)})
            yield made
