"""A trial through the model, sample by sample: the same steps as the node takes."""

from __future__ import annotations

from collections.abc import Mapping, MutableMapping, Sequence
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError, naming
from xb_muscle_ros.models.inputs import check_samples
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.registry import PUSHES_F0, slack_of
from xb_muscle_ros.trials.simulated import MOMENTS, Simulated
from xb_muscle_ros.trials.spool import release, roomy
from xb_muscle_ros.trials.stamps import to_ns
from xb_muscle_ros.trials.trial import Array, Trial

# So many samples are simulated together.
_AT_ONCE = 1 << 16
_ANSWER = ("force_n", "ce_length_m", "ce_velocity_m_per_s")


def calcium_per_step(trial: Trial) -> Array:
    """Calcium (µM) that acts in the step ending at each sample, shape (n,).

    A value holds until the next: the step that ends at sample k uses the newest calcium stamped no later than sample
    k - 1; the first entry, with which the fibre settles, the newest stamped no later than the first sample.

    Raises:
        UserError: no calcium is known at the first sample.
    """
    return _calcium(trial, 0, trial.time_s.size)


def _calcium(trial: Trial, first: int, end: int) -> Array:
    """The same of some of the samples."""
    starts = trial.time_s[first - 1 : end - 1] if first else np.concatenate([trial.time_s[:1], trial.time_s[: end - 1]])
    index = np.searchsorted(trial.calcium_time_s, starts, side="right") - 1
    if index[0] < 0:
        raise UserError(
            f"trial {trial.facts.trial}: first calcium is stamped {trial.calcium_time_s[0]:g} s, after the first length"
            f" at {trial.time_s[0]:g} s; give the calcium that the fibre starts with"
        )
    held: Array = trial.calcium_um[index]
    return held


def outputs(
    muscle: Muscle,
    dt_s: Array,
    length_l0: Array,
    calcium_um: Array,
    substeps: int = 1,
    settle_s: float | None = None,
    settled: MutableMapping[tuple[float, float], Array] | None = None,
) -> Mapping[str, Array]:
    """Settle isometrically at the first sample, step from sample to sample, and read the outputs.

    Args:
        dt_s: between samples, shape (n - 1,), s.
        length_l0: length change at the samples, linear between them, shape (n,), L0.
        calcium_um: calcium that acts in the step that ends at a sample, shape (n,), µM.
        substeps: steps between two samples; 1 is what the node does.
        settle_s: time to settle, s; None until at rest.
        settled: settled states by length and calcium, which are looked up here and added to.

    Returns:
        See `Muscle.outputs_of`, each of shape (n,).

    Raises:
        UserError: length or calcium out of range.
        StateViolation: see `Muscle.step`.
    """
    begin = (float(length_l0[0]), float(calcium_um[0]))
    known = {} if settled is None else settled
    if begin not in known:
        known[begin] = muscle.settle(*begin, settle_s)
    return muscle.outputs_of(muscle.run(known[begin], dt_s, length_l0, calcium_um, substeps))


def simulate_trial(muscle: Muscle, trial: Trial, substeps: int = 1, settle_s: float | None = None) -> Simulated:
    """Settle isometrically at the first sample, then step from sample to sample.

    Args:
        trial: length and calcium; length is linear between samples, calcium holds.
        substeps: steps between two samples; 1 is what the node does.
        settle_s: time to settle, s; None until at rest.

    Raises:
        UserError: no calcium at the start, or length or calcium out of range; names the trial.
        StateViolation: see `Muscle.step`; names the trial.
    """
    # Part by part, because the states and outputs of an hour at 1 kHz would take half a gigabyte.
    size = trial.time_s.size
    parts = [slice(max(first - 1, 0), min(first + _AT_ONCE, size)) for first in range(0, size, _AT_ONCE)]
    answer = {name: roomy(size) for name in (*_ANSWER, *MOMENTS)}
    begin = _driven(trial, slice(0, 1))
    with naming(f"trial {trial.facts.trial}"):
        state = muscle.settle(float(begin.length_l0[0]), float(begin.calcium_um[0]), settle_s)
        for part in parts:
            check_samples(muscle.fibre.name, *_driven(trial, part), part.start)
        for part in parts:
            begin_s = float(trial.time_s[part.start] - trial.time_s[0])
            states = muscle.run(state, *_driven(trial, part), substeps, begin_s=begin_s)
            state = states[-1].copy()
            made = as_simulated(trial, trial.time_s[part], muscle.outputs_of(states))
            for name in _ANSWER:
                answer[name][part] = getattr(made, name)
            for name in MOMENTS:
                answer[name][part] = made.moments[name]
            release(*answer.values())
    for values in answer.values():
        values.setflags(write=False)
    moments = {name: answer.pop(name) for name in MOMENTS}
    return Simulated(trial.time_s, **answer, moments=moments)


class _Driven(NamedTuple):
    """What drives a fibre: time between samples (s), length change at them (L0), calcium (µM) as in `outputs`."""

    dt_s: Array
    length_l0: Array
    calcium_um: Array


def _driven(trial: Trial, part: slice) -> _Driven:
    # Whole nanoseconds, as message stamps have them: the node computes the same differences.
    dt_s = np.diff(to_ns(trial.time_s[part])) / 1e9
    length_l0 = trial.length_m[part] / trial.facts.reference_length_m - 1.0
    return _Driven(dt_s, length_l0, _calcium(trial, part.start, part.stop))


def as_simulated(trial: Trial, time_s: Array, out: Mapping[str, Array]) -> Simulated:
    """Outputs of a trial in SI units."""
    reference = trial.facts.reference_length_m
    return Simulated(
        time_s=time_s,
        force_n=out["force_f0"] * trial.facts.f0_n,
        ce_length_m=reference * (1.0 + out["ce_length_change_l0"]),
        ce_velocity_m_per_s=reference * out["ce_velocity_l0_per_s"],
        moments={name: out[name] for name in MOMENTS},
    )


def pushing(trial: Trial, simulated: Simulated, model: str) -> str | None:
    """One line on a model that pushes, where a muscle would be slack; None where it pulls.

    Args:
        model: its name, or that of its parameter set.
    """
    return pushing_line(trial.facts.trial, model, simulated.time_s, simulated.force_n / trial.facts.f0_n)


def pushing_line(trial: str, model: str, time_s: Array, force_f0: Array) -> str | None:
    """The line of `pushing`, from the name of a trial and its force, shape (n,), s and F0."""
    k = int(np.argmin(force_f0))
    if force_f0[k] >= PUSHES_F0:
        return None
    slack = slack_of(model)
    remedy = f"; in model {slack} the series spring goes slack (docs/model.md)" if slack else ""
    return (
        f"trial {trial}: model {model} pushes, force falls to {force_f0[k]:.3g} F0 at t = {time_s[k]:g} s, where a "
        f"muscle would be slack{remedy}"
    )


def one_for_all(lines: Sequence[str]) -> list[str]:
    """The first of the lines of `pushing`, and of how many more trials the same is true."""
    more = len(lines) - 1
    return [f"{lines[0]}; likewise in {more} more trial{'s' * (more > 1)}" if more else lines[0]] if lines else []
