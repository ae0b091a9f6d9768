"""What an evaluation knows of its recordings: what each bag showed, and columns of numbers over all of them."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.evaluate.sets import rank
from xb_muscle_ros.evaluate.srs_table import FibreSrs, SrsTable, levels
from xb_muscle_ros.scores.conditions import AMPLITUDES_L0, RECOVERIES_S
from xb_muscle_ros.scores.estimate import Estimate
from xb_muscle_ros.scores.readout import ISOMETRIC, SRS_CONDITIONING, SRS_TEST
from xb_muscle_ros.simulation.offline import one_for_all
from xb_muscle_ros.trials.study import alike
from xb_muscle_ros.trials.trial import Array

MEASURED = "measured"
WINDOWS = ("whole", "conditioning", "test")
# A table over more levels than this on an axis is one over the common conditions only.
_MOST_LEVELS = 40


@dataclass(frozen=True)
class Facts:
    """What grouping and pairing of trials need to know of one.

    Attributes:
        path: of its bag.
        fibre, trial: names.
        pca, amplitude_l0, recovery_s: condition; None where not known.
        peak_calcium_um: largest free calcium, µM.
        final_length_l0: length change at the end, L0.
        stretch_l0: size of the one stretch of a trial that has nothing else, L0; None for other trials.
        moves: whether the length changes at all.
        content: equal for recordings that hold the same samples.
    """

    path: str
    fibre: str
    trial: str
    pca: float | None
    amplitude_l0: float | None
    recovery_s: float | None
    peak_calcium_um: float
    final_length_l0: float
    stretch_l0: float | None
    moves: bool
    content: str


@dataclass(frozen=True)
class Evaluated:
    """What a bag, or one fibre's trial in it, showed.

    Attributes:
        bag: as the user named it.
        several: fibres of a bag that has more than one, where the task does not choose; then nothing else.
        problem: why it cannot be used, one line; then nothing else but `unserved`.
        unserved: the fibre that no fibre file serves.
        scores: what `MEASURED` force and each model show, by quantity: ``rmsd_whole``, ``rmsd_conditioning`` and
            ``rmsd_test`` (F0), the keys of `scores.readout.TEXT` (F0/L0, F0) and ``k_tr`` (1/s).
        pushes: models that push where a muscle would be slack, and a line on each.
        missing: models without parameter set.
        warnings: of the reader.
        notes: lines on facts that are not the bag's own.
    """

    bag: str
    several: Sequence[str] = ()
    problem: str = ""
    unserved: str = ""
    facts: Facts | None = None
    scores: Mapping[str, Mapping[str, Estimate]] = field(default_factory=dict)
    pushes: Mapping[str, str] = field(default_factory=dict)
    missing: Sequence[str] = ()
    warnings: Sequence[str] = ()
    notes: Sequence[str] = ()


class Trials:
    """All bags in their order; a trial that comes a second time, by name or by content, is a problem.

    Attributes:
        found: what each bag showed.
        facts: of each trial; None for bags that cannot be used, shape (bags,).
        good: which bags can be used, shape (bags,).
        problems: bag -> why it cannot be used, one line.
        fibres: names, sorted.
        models: parameter sets that were compared, simplest first.
        pca, amplitude_l0, recovery_s: shape (bags,), NaN where not known.
    """

    def __init__(self, found: Sequence[Evaluated]) -> None:
        """Take what `evaluate_bag` found, in the order of the bags."""
        self.found = list(found)
        self.problems = {each.bag: each.problem for each in found if each.problem}
        again = dict(_duplicates(found))
        self.problems |= {found[index].bag: problem for index, problem in again.items()}
        self.facts = [None if index in again else each.facts for index, each in enumerate(found)]
        self.good = np.array([facts is not None for facts in self.facts], dtype=bool)
        self._fibre = np.array(["" if facts is None else facts.fibre for facts in self.facts])
        self.fibres = sorted({facts.fibre for facts in self.facts if facts is not None})
        models = {name for each in found for name in each.scores} - {MEASURED}
        self.models = sorted(models, key=lambda name: (rank(name), name))
        self.pca, self.amplitude_l0, self.recovery_s = (
            _numbers(None if facts is None else getattr(facts, name) for facts in self.facts)
            for name in ("pca", "amplitude_l0", "recovery_s")
        )

    @functools.cache  # noqa: B019 - there is one of these in a run
    def column(self, of: str, quantity: str) -> tuple[Array, Array]:
        """Values and standard errors of a quantity, measured or by a model, shape (bags,); NaN where there is none."""
        each = [one.scores.get(of, {}).get(quantity, Estimate(None)) for one in self.found]
        return _numbers(one.value for one in each), _numbers(one.se for one in each)

    def usable(self) -> Iterator[tuple[int, Facts]]:
        """Places and facts of the trials that can be used."""
        return ((index, facts) for index, facts in enumerate(self.facts) if facts is not None)

    def is_of(self, fibre: str) -> npt.NDArray[np.bool_]:
        """Which bags are of a fibre, shape (bags,)."""
        mine: npt.NDArray[np.bool_] = self._fibre == fibre
        return mine

    def why(self, index: int, of: str) -> dict[str, str]:
        """What a trial lacks that could be expected, measured or by a model, and why."""
        return {name: each.why for name, each in self.found[index].scores.get(of, {}).items() if each.why}

    @property
    def missing(self) -> dict[str, list[str]]:
        """Parameter sets, and the fibres whose file lacks them."""
        fibres: dict[str, set[str]] = {}
        for each in self.found:
            for name in each.missing:
                fibres.setdefault(name, set()).add("" if each.facts is None else each.facts.fibre)
        return {name: sorted(of) for name, of in sorted(fibres.items())}

    @property
    def warnings(self) -> list[str]:
        """All warnings in order of the bags, those alike in one; then one for each model that pushes."""
        lines = alike(line for each in self.found for line in each.warnings)
        pushing = dict.fromkeys(name for each in self.found for name in each.pushes)
        for name in pushing:
            lines += one_for_all([self.found[i].pushes[name] for i, _ in self.usable() if name in self.found[i].pushes])
        return lines

    def problem_lines(self) -> list[str]:
        """A line for each bag that cannot be used, one alone for all whose fibre has no file."""
        unserved: dict[str, list[str]] = {}
        for each in self.found:
            if each.unserved:
                unserved.setdefault(each.unserved, []).append(each.bag)
        shared = {fibre: sorted(bags) for fibre, bags in sorted(unserved.items()) if len(bags) > 1}
        in_one = {bag for bags in shared.values() for bag in bags}
        lines = [self.problems[bag] for bag in sorted(self.problems) if bag not in in_one]
        for bags in shared.values():
            why = self.problems[bags[0]].removeprefix(f"bag {bags[0]}: ")
            lines.append(f"{len(bags)} bags, from {bags[0]} to {bags[-1]}: {why}")
        return lines


def _duplicates(found: Sequence[Evaluated]) -> Iterator[tuple[int, str]]:
    names: dict[tuple[str, str], int] = {}
    contents: dict[str, int] = {}
    for i, each in enumerate(found):
        if each.facts is None:
            continue
        fibre, trial = each.facts.fibre, each.facts.trial
        first = names.setdefault((fibre, trial), i)
        if first != i:
            told = f"trial {trial} of fibre {fibre} is in {found[first].bag} already"
            yield i, f"bag {each.bag}: {told}; give every trial once"
            continue
        first = contents.setdefault(each.facts.content, i)
        if first != i:
            yield i, f"bag {each.bag} holds the same samples as {found[first].bag}; give every trial once"


def srs_table(trials: Trials, of: str, label: str) -> SrsTable | None:
    """SRS and isometric force of the trials of the paper's protocol; repeats of a condition are averaged.

    Args:
        of: parameter set, or `MEASURED`.

    Returns:
        None where no trial has pCa, amplitude and recovery time.
    """
    conditions = (trials.pca, trials.recovery_s, trials.amplitude_l0)
    used = trials.good & np.all(np.isfinite(conditions), axis=0)
    if not np.any(used):
        return None
    common = (None, RECOVERIES_S, (0.0, *AMPLITUDES_L0))
    axes = [_axis(values[used], few) for values, few in zip(conditions, common, strict=True)]
    places = [_places(axis, values) for axis, values in zip(axes, conditions, strict=True)]
    used &= np.all([p >= 0 for p in places], axis=0)
    shape = tuple(axis.size for axis in axes)
    fibres, repeats_left_out = {}, 0
    for name in trials.fibres:
        mine = used & trials.is_of(name)
        cell = tuple(p[mine] for p in places)
        (test, test_se, out), (conditioning, conditioning_se, _), (isometric, _, _) = (
            _mean_in_cells(values[mine], errors[mine], cell, shape)
            for values, errors in (trials.column(of, name) for name in (SRS_TEST, SRS_CONDITIONING, ISOMETRIC))
        )
        fibres[name] = FibreSrs(test, conditioning, isometric, test_se, conditioning_se)
        repeats_left_out += out
    pca, recovery_s, amplitude_l0 = axes
    return SrsTable(label, pca, recovery_s, amplitude_l0, fibres, repeats_left_out)


def _axis(values: Array, common: tuple[float, ...] | None) -> Array:
    """Distinct nominal values; the common ones alone where there are too many."""
    found = levels(values)
    return np.array(common) if common is not None and found.size > _MOST_LEVELS else found


def _places(axis: Array, values: Array) -> npt.NDArray[np.int64]:
    """Nearest level of each value; -1 where none is near or the value is NaN."""
    whole = np.where(np.isfinite(values), values, -1.0)
    nearest = np.argmin(np.abs(axis[None, :] - whole[:, None]), axis=1)
    near = np.isclose(axis[nearest], whole, rtol=1e-3, atol=1e-6)
    return np.where(near, nearest, -1)


def _mean_in_cells(
    values: Array, errors: Array, cell: tuple[npt.NDArray[np.int64], ...], shape: tuple[int, ...]
) -> tuple[Array, Array, int]:
    """Means, their standard errors, and how many repeats are left out.

    Left out of a mean is a repeat with a standard error as large as the largest of them, where another has less:
    repeats differ by more than their noise, so that weights by 1/SE² would leave little but one of them.
    """
    some = np.isfinite(values)
    values, errors, at = values[some], errors[some], tuple(index[some] for index in cell)
    largest, least = np.zeros(shape), np.full(shape, np.inf)
    np.maximum.at(largest, at, np.abs(values))
    np.fmin.at(least, at, errors)
    kept = ~((errors >= largest[at]) & (least[at] < largest[at]))
    values, errors, at = values[kept], errors[kept], tuple(index[kept] for index in at)
    total, count, squares = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    np.add.at(total, at, values)
    np.add.at(count, at, 1.0)
    np.add.at(squares, at, errors**2)
    divisor = np.where(count > 0.0, count, np.nan)
    return total / divisor, np.sqrt(squares) / divisor, int(np.count_nonzero(~kept))


def _numbers(values: Iterable[float | None]) -> Array:
    return np.array([math.nan if value is None else value for value in values], dtype=np.float64)
