"""Trials made from arrays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.api.telling import Lines, Tell
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.bag_reading import Reading
from xb_muscle_ros.trials.between_samples import with_corners
from xb_muscle_ros.trials.checks import check_values
from xb_muscle_ros.trials.completing import Known, complete
from xb_muscle_ros.trials.stamps import to_ns
from xb_muscle_ros.trials.trial import Array, Trial, TrialFacts


def make_trial(
    fibre: str,
    name: str,
    time: npt.ArrayLike,
    length: npt.ArrayLike,
    calcium: npt.ArrayLike,
    force: npt.ArrayLike | None = None,
    *,
    reference_length_m: float = 1.0,
    f0_n: float = 1.0,
    tell: Tell | None = None,
) -> Trial:
    """Make a trial of samples; phases, amplitude, recovery and pCa are found from length and calcium.

    Args:
        fibre: name of the fibre.
        name: of the trial, unique within a study.
        time: shape (n,), strictly increasing from 0 on, s.
        length: shape (n,), length change relative to rest, L0.
        calcium: free calcium, µM; a number, or shape (n,): each value holds until the next.
        force: shape (n,), measured force, F0; None where there is none.
        reference_length_m: the length that is L0, m.
        f0_n: the force that is F0, N.
        tell: hears each line on what was found or is odd; None: a `DataWarning` each.

    Returns:
        the trial, in SI units.

    Raises:
        UserError: shapes that do not belong together, samples that are not finite or not in order, values that no
            muscle has.

    Source:
        phases: docs/bags.md.

    Examples:
        >>> import numpy as np, xb_muscle_ros as xb
        >>> t = np.arange(0.0, 0.5, 1e-3)
        >>> stretch = np.interp(t, [0.1, 0.2], [0.0, 0.0383])
        >>> trial = xb.make_trial("mine", "first", t, stretch, calcium=0.8, tell=lambda line: None)
        >>> [phase.name for phase in trial.facts.phases]
        ['isometric', 'test_stretch', 'hold']
    """
    lines = Lines(tell)
    for what, value in (("reference_length_m", reference_length_m), ("f0_n", f0_n)):
        if not 0.0 < value < np.inf:
            raise UserError(f"{what} is {value:g}; allowed are numbers above 0")
    trial = normalised(fibre, name, time, length, calcium, force)
    facts = replace(trial.facts, reference_length_m=reference_length_m, f0_n=f0_n)
    scaled = replace(trial, facts=facts, length_m=trial.length_m * reference_length_m, force_n=trial.force_n * f0_n)
    found, notes = completed(scaled)
    finer = with_corners(found)
    if finer is not found:
        notes = (*notes, "corners of length between samples were recovered")
    lines.say(*(f"trial {name}: {line}" for line in notes), *check_values(finer, name))
    return finer


def completed(trial: Trial) -> tuple[Trial, tuple[str, ...]]:
    """A trial with the facts that its samples show, and a line on each."""
    return complete(Reading(trial, frozenset({"phases", "amplitude_l0", "recovery_s", "pca"})), Known())


def normalised(
    fibre: str,
    name: str,
    time: npt.ArrayLike,
    length: npt.ArrayLike,
    calcium: npt.ArrayLike,
    force: npt.ArrayLike | None = None,
) -> Trial:
    """A trial of samples in normalised units (1 m is L0, 1 N is F0), checked.

    Raises:
        UserError: see `make_trial`.
    """
    time_s = _numbers("time", time)
    if time_s.ndim != 1 or time_s.size < 2:
        raise UserError(f"time has shape {time_s.shape}; needed are two samples or more, shape (n,)")
    # As message stamps have them, so that a trial and its bag give the same simulation.
    back = np.flatnonzero(np.diff(to_ns(time_s)) <= 0)
    if time_s[0] < 0.0 or back.size:
        at = 0 if time_s[0] < 0.0 else int(back[0]) + 1
        raise UserError(
            f"time, sample {at} is {time_s[at]:.9g} s; allowed are times from 0 on that increase by at least 1 ns"
        )
    time_s = np.round(time_s * 1e9) / 1e9
    level = _numbers("calcium", calcium)
    held = level.ndim == 0
    return Trial(
        facts=TrialFacts(fibre=fibre, trial=name),
        time_s=time_s,
        length_m=1.0 + _like("length", length, time_s),
        calcium_time_s=time_s[:1] if held else time_s,
        calcium_um=np.atleast_1d(level) if held else _like("calcium", level, time_s),
        force_time_s=np.empty(0) if force is None else time_s,
        force_n=np.empty(0) if force is None else _like("force", force, time_s),
    )


def _numbers(what: str, given: npt.ArrayLike) -> Array:
    try:
        array = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise UserError(f"{what} is no array of numbers: {error}") from None
    bad = np.flatnonzero(~np.isfinite(np.atleast_1d(array)))
    if bad.size:
        raise UserError(f"{what}, sample {bad[0]} is {np.atleast_1d(array).flat[bad[0]]}; allowed are finite numbers")
    return array


def _like(what: str, given: npt.ArrayLike, time_s: Array) -> Array:
    array = _numbers(what, given)
    if array.shape != time_s.shape:
        raise UserError(f"{what} has shape {array.shape}; needed is that of time, {time_s.shape}")
    return array
