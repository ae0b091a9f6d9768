"""Phases of a trial found from its length record: the paper's protocol, or stretches and shortenings by turns.

The protocol is isometric, conditioning stretch, shortening back, recovery, test stretch, hold; without the first
stretch (the reference trial) isometric, test stretch, hold. Anything else is told in order of time as ``isometric``
before the first change of length, ``stretch``, ``shortening`` or, where it is quick, ``release``, and between them
``hold`` after a stretch and ``recovery`` after a shortening. Release and restretch (k_tr) are ``release``, ``hold``
while slack, ``stretch`` and ``recovery``.
"""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.trials.corners import Piece, straight_pieces
from xb_muscle_ros.trials.runs import RELEASE_L0_PER_S, RELEASE_S
from xb_muscle_ros.trials.stated import before, leaves_room_for_pause, leaves_room_for_stretch
from xb_muscle_ros.trials.trial import Array, Phase

_CONDITIONED = (1, -1, 1)
_REFERENCE = (1,)
# Between release and restretch there is no more time than this, s, and they end this near where they began (part of
# the release).
_SLACK_S = 0.2
_BACK = 0.2
# A record moves where means of so many parts differ by this share of length, and by so many of their standard errors.
_PARTS, _LEAST_MOVE, _ERRORS = 20, 3e-3, 8.0
_CONDITIONED_NAMES = ("conditioning_stretch", "shortening", "test_stretch")


def detect_phases(
    time_s: Array,
    length: Array,
    amplitude_l0: float | None = None,
    recovery_s: float | None = None,
    l0: float | None = None,
    servo_give: float = 0.0,
) -> tuple[Phase, ...]:
    """Find the phases of a trial.

    Args:
        time_s: shape (n,), strictly increasing, s.
        length: shape (n,), length (not its change) in any unit; noise and rounded corners are allowed.
        amplitude_l0: the amplitude of the conditioning stretch where it is known, L0. A stretch too small to be seen
            in the record is then placed by the protocol, counting back from the test stretch at the same speed.
        recovery_s: the time between shortening and test stretch where it is known, s. A pause too short to be seen
            in the record then gets this duration around the corner in which it hides. Neither counts where the
            record would show it and does not.
        l0: the length that is L0, in the unit of length; None for the median of the record.
        servo_give: changes of length up to this that come back are none: the motor gave under the muscle's force.

    Returns:
        Phases in order of time, touching each other, from the first sample to the last. Onsets of stretches are
        good to about a sample at 1 kHz, because they are where fitted lines meet.
    """
    length = np.asarray(length, dtype=np.float64)
    l0 = float(np.median(length)) if l0 is None else l0
    time_s = np.asarray(time_s, dtype=np.float64)
    pieces = straight_pieces(time_s, length, l0, servo_give)
    ramps = tuple(piece.direction for piece in pieces if piece.direction)
    if ramps == _CONDITIONED and all(piece.direction for piece in _between(pieces)):
        return _named(_with_pause(time_s, length, pieces, recovery_s), _CONDITIONED_NAMES)
    if ramps == _CONDITIONED and len(_between(pieces)) == 2 and _between(pieces)[1].direction == 0:
        return _named(pieces, _CONDITIONED_NAMES)
    if amplitude_l0 and recovery_s and ramps and ramps[-1] > 0 and pieces[0].direction == 0:
        placed = _placed_by_protocol(time_s, length, pieces, amplitude_l0, recovery_s)
        if placed is not None:
            return _named(placed, _CONDITIONED_NAMES)
    if ramps == _REFERENCE:
        return _named(pieces, ("test_stretch",))
    names = _names(pieces, l0)
    return tuple(Phase(name, piece.start_s, piece.end_s) for name, piece in zip(names, pieces, strict=True))


def conditioning(
    time_s: Array, length_m: Array, l0: float, phases: tuple[Phase, ...]
) -> tuple[float | None, float | None]:
    """Amplitude of the conditioning stretch (L0; 0 for a reference trial) and recovery (s) as phases show them.

    Args:
        time_s, length_m: shape (n,), the record; s, m.
        l0: the length that is L0, m.

    Returns:
        None for what is not plain: both where the trial is no paper's protocol, recovery of a reference trial.
    """
    found = {phase.name: phase for phase in phases}
    if "test_stretch" not in found:
        return None, None
    if "conditioning_stretch" not in found:
        return 0.0, None
    stretch, rest = found["conditioning_stretch"], found.get("recovery")
    start_m, end_m = np.interp([stretch.start_s, stretch.end_s], time_s, length_m)
    return round(float(end_m - start_m) / l0, 4), round(rest.end_s - rest.start_s, 4) if rest else 0.0


def initial_isometric(time_s: Array, phases: tuple[Phase, ...]) -> slice:
    """Samples of the isometric phase that begins a trial, without its last fifth (smoothing leaks the stretch into it).

    Returns:
        A slice of ``time_s``; empty where the trial does not begin isometrically.
    """
    if not phases or phases[0].name != "isometric":
        return slice(0, 0)
    first = phases[0]
    end_s = first.end_s if len(phases) == 1 else first.start_s + 0.8 * (first.end_s - first.start_s)
    return slice(0, int(np.searchsorted(time_s, end_s, side="right")))


def moves(length_m: Array) -> bool:
    """Whether length changes, slowly or under noise: means of stretches of the record differ beyond their errors."""
    parts = np.array_split(length_m, min(_PARTS, max(length_m.size // 4, 1)))
    means = np.array([float(np.mean(part)) for part in parts])
    errors = np.array([float(np.std(part)) / np.sqrt(part.size) for part in parts])
    least = max(_LEAST_MOVE * float(np.median(length_m)), _ERRORS * float(np.median(errors)))
    return bool(np.ptp(means) > least)


def _names(pieces: list[Piece], l0: float) -> list[str]:
    """Names of pieces that are not the paper's protocol."""
    names = []
    for i, piece in enumerate(pieces):
        if piece.direction > 0:
            names.append("stretch")
        elif piece.direction < 0:
            names.append("release" if _is_release(piece, l0) else "shortening")
        elif i == 0:
            names.append("isometric")
        else:
            slack = names[-1] == "release" and _is_slack(pieces[i - 1 : i + 2])
            restretched = names[-3:] == ["release", "hold", "stretch"]
            names.append("hold" if slack or (names[-1] == "stretch" and not restretched) else "recovery")
    return names


def _is_release(piece: Piece, l0: float) -> bool:
    return piece.end_s - piece.start_s <= RELEASE_S and abs(piece.line[0]) >= RELEASE_L0_PER_S * l0


def _is_slack(pieces: list[Piece]) -> bool:
    """Whether a release, a level and what follows are release, slack and restretch."""
    if len(pieces) < 3 or pieces[2].direction <= 0 or pieces[1].end_s - pieces[1].start_s > _SLACK_S:
        return False
    down, up = (piece.line[0] * (piece.end_s - piece.start_s) for piece in (pieces[0], pieces[2]))
    return abs(up + down) <= _BACK * abs(down)


def _between(pieces: list[Piece]) -> list[Piece]:
    """Pieces after the conditioning stretch and before the test stretch."""
    ramps = [i for i, piece in enumerate(pieces) if piece.direction]
    return pieces[ramps[0] + 1 : ramps[-1]]


def _with_pause(time_s: Array, length: Array, pieces: list[Piece], recovery_s: float | None) -> list[Piece]:
    """Put a pause of known duration around the corner between shortening and test stretch, where it may hide.

    Lines of equal and opposite slope that stop at a level and leave it again meet in the middle of the pause.
    """
    i = next(i for i, piece in enumerate(pieces) if piece.direction < 0)
    down, up = pieces[i], pieces[i + 1]
    if not recovery_s or not leaves_room_for_pause(time_s, length, down, up, recovery_s):
        return pieces
    half = min(0.5 * recovery_s, 0.9 * (down.end_s - down.start_s), 0.9 * (up.end_s - up.start_s))
    start_s, end_s = down.end_s - half, down.end_s + half
    level = down.line[0] * start_s + down.line[1]
    pause = Piece(0, start_s, end_s, (0.0, level))
    return [*pieces[:i], down._replace(end_s=start_s), pause, up._replace(start_s=end_s), *pieces[i + 2 :]]


def _placed_by_protocol(
    time_s: Array, length: Array, pieces: list[Piece], amplitude_l0: float, recovery_s: float
) -> list[Piece] | None:
    """The protocol's pieces counted back from the test stretch.

    Returns:
        None where the record begins too late for them, or would show them and does not.
    """
    i = max(i for i, piece in enumerate(pieces) if piece.direction)
    test, first = pieces[i], pieces[0]
    stretch = before(test.start_s, test.line[0], amplitude_l0 * first.line[1], recovery_s)
    onset_s, down_end_s = stretch.onset_s, test.start_s - recovery_s
    peak_s = down_end_s - stretch.ramp_s
    if onset_s <= first.start_s or not leaves_room_for_stretch(time_s, length, stretch):
        return None
    slope = test.line[0]
    return [
        first._replace(end_s=onset_s),
        Piece(1, onset_s, peak_s, (slope, first.line[1] - slope * onset_s)),
        Piece(-1, peak_s, down_end_s, (-slope, first.line[1] + slope * down_end_s)),
        Piece(0, down_end_s, test.start_s, first.line),
        *pieces[i:],
    ]


def _named(pieces: list[Piece], ramp_names: tuple[str, ...]) -> tuple[Phase, ...]:
    names = iter(ramp_names)
    phases = []
    done = 0
    for piece in pieces:
        if piece.direction:
            name = next(names)
            done += 1
        else:
            name = "isometric" if done == 0 else "hold" if done == len(ramp_names) else "recovery"
        phases.append(Phase(name, piece.start_s, piece.end_s))
    return tuple(phases)
