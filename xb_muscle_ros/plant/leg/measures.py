"""What an episode says: stiffness of the ankles, way of the centre of mass, time to fall, what grows."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.plant.leg.episode import JOINTS, Episode
from xb_muscle_ros.plant.leg.study import Pair
from xb_muscle_ros.plant.plant import Array

STIFFNESS_AT_S = (0.02, 0.05, 0.1)
COM_AT_S = (0.1, 0.3)
BAR_M = 0.005
"""A stance holds as long as the centre of mass stays within."""
Numbers = dict[str, float | None]


def row(episode: Episode, time_s: float) -> int | None:
    """Row of a time; None: the episode ends before."""
    at = int(np.searchsorted(episode.time_s, time_s - 1e-9))
    return at if at < episode.time_s.size else None


def ankle_change(pair: Pair, time_s: float) -> tuple[float, float] | None:
    """Change of ankle angle (rad) and torque (N·m) by the push until a time: pushed less still, since the start."""
    rows = (row(pair.pushed, time_s), row(pair.still, time_s))
    if rows[0] is None or rows[1] is None:
        return None
    changes = [
        np.array([values[at, 0] - values[0, 0] for values in (episode.angle_rad, episode.torque_nm)])
        for episode, at in ((pair.pushed, rows[0]), (pair.still, rows[1]))
    ]
    angle, torque = (changes[0] - changes[1]).tolist()
    return angle, torque


def stiffness_nm_per_rad(pair: Pair, time_s: float) -> float | None:
    """Chordal stiffness of both ankles: change of torque by the push over change of angle by the push.

    None: an episode ends before, or the ankles do not turn.
    """
    change = ankle_change(pair, time_s)
    return None if change is None or abs(change[0]) < 1e-9 else change[1] / change[0]


def at_time(episode: Episode, values: Array, time_s: float) -> float | None:
    """Change of values, shape (n,), from the start to a time; None: the episode ends before."""
    at = row(episode, time_s)
    return None if at is None else float(values[at] - values[0])


def numbers(pair: Pair) -> Numbers:
    """Scores of a push."""
    pushed, still = pair.pushed, pair.still
    found: Numbers = {
        "torque_at_start_nm": float(pushed.torque_nm[0, 0]),
        "start_acceleration_still": still.start_acceleration,
    }
    for time_s in STIFFNESS_AT_S:
        name, value = f"stiffness_{1000 * time_s:.0f}ms", stiffness_nm_per_rad(pair, time_s)
        found[f"{name}_nm_per_rad"] = value
        found[f"{name}_mgh"] = None if value is None else value / pushed.load_nm_per_rad
    for time_s in COM_AT_S:
        com = at_time(pushed, pushed.com_m, time_s)
        alone = at_time(still, still.com_m, time_s)
        name = f"com_{1000 * time_s:.0f}ms"
        found[f"{name}_m"] = com
        found[f"{name}_without_push_m"] = alone
        found[f"{name}_by_push_m"] = None if com is None or alone is None else com - alone
    found["time_to_fall_s"] = fall_s(pushed)
    found["time_to_fall_without_push_s"] = fall_s(still)
    return found


def fall_s(episode: Episode) -> float | None:
    """When the body fell; None: it did not within the episode."""
    return episode.end.time_s if episode.end is not None and episode.end.fell else None


def held(episode: Episode) -> Numbers:
    """How far the centre of mass went without a push, and how long it stayed within `BAR_M`."""
    away = np.hypot(episode.com_m, episode.height_m - episode.height_m[0])
    beyond = np.flatnonzero(away > BAR_M)
    return {
        "largest_com_m": float(away.max()),
        "within_bar_s": float(episode.time_s[beyond[0]]) if beyond.size else None,
        "start_acceleration": episode.start_acceleration,
        "time_to_fall_s": fall_s(episode),
    }


def growth(nudged: Episode) -> Numbers:
    """What grows after a nudge: time in which it grows e-fold, and how far joints take part (angle by ankle angle).

    Fitted to the logarithm of the centre of mass's way over the second half of the episode; None: it does not grow.
    """
    late = nudged.time_s >= 0.5 * nudged.time_s[-1]
    way = np.abs(nudged.com_m[late])
    if way.size < 2 or not np.all(way > 0.0):
        return {"e_fold_s": None}
    rate = float(np.polyfit(nudged.time_s[late], np.log(way), 1)[0])
    change = nudged.angle_rad[-1] - nudged.angle_rad[0]
    shares = {f"{joint}_by_ankle": float(change[i] / change[0]) for i, joint in enumerate(JOINTS) if i}
    return {"e_fold_s": 1.0 / rate if rate > 0.0 else None, **shares}
