"""What a run found out of its recordings, in columns: memory for 10,000 trials and six models is a few megabytes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.evaluate.srs_table import FibreSrs, SrsTable
from xb_muscle_ros.scores.conditions import AMPLITUDES_L0, CONDITIONS, RECOVERIES_S
from xb_muscle_ros.simulation.offline import one_for_all
from xb_muscle_ros.trials.study import alike
from xb_muscle_ros.trials.trial import Array

MEASURED = "measured"
WINDOWS = ("whole", "conditioning", "test")
_READ_OFF = ("srs_conditioning", "srs_test", "isometric_f0")
_ANSWERS = (*(f"{name}{end}" for name in _READ_OFF for end in ("", "_se")), "k_tr", "k_tr_se")
MODEL_FIELDS = (*(f"rmsd_{window}" for window in WINDOWS), *_ANSWERS)
# A table over more levels than this on an axis is one over the common conditions only.
_MOST_LEVELS = 40


class Trials:
    """Results of all bags, in their order.

    Attributes:
        bag, fibre, trial, content: one string for each bag; empty where it has a problem.
        pca, amplitude_l0, recovery_s: shape (bags,), NaN where not known.
        measured: quantity -> shape (bags,); F0/L0, F0, 1/s.
        models: parameter set -> quantity -> shape (bags,), as measured, and ``rmsd_whole`` and so on, F0.
        problems: bag -> why it cannot be used, one line.
        unserved: fibre that no fibre file serves -> its bags, each of which has a problem.
        warnings: lines, in order of the bags.
        missing: parameter set -> fibres whose file lacks it.
    """

    def __init__(self, bags: int) -> None:
        """Nothing known yet."""
        self._bags = bags
        self.bag, self.fibre, self.trial, self.content = ([""] * bags for _ in range(4))
        self.pca, self.amplitude_l0, self.recovery_s = (np.full(bags, np.nan) for _ in range(3))
        self.measured: dict[str, Array] = {name: np.full(bags, np.nan) for name in _ANSWERS}
        self.models: dict[str, dict[str, Array]] = {}
        self.problems: dict[str, str] = {}
        self.unserved: dict[str, list[str]] = {}
        self.missing: dict[str, set[str]] = {}
        self._warnings: dict[int, list[str]] = {}
        self._pushes: dict[str, dict[int, str]] = {}
        self._why: dict[int, dict[str, dict[str, str]]] = {}
        self._codes: dict[str, int] = {}
        self._code = np.full(bags, -1)
        self._shapes: dict[int, dict[str, Any]] = {}

    def add(self, index: int, found: Mapping[str, Any]) -> None:
        """Keep what `evaluate_bag` found of the bag at a place."""
        self.bag[index] = found["bag"]
        if "problem" in found:
            self.problems[found["bag"]] = found["problem"]
            if "unserved" in found:
                self.unserved.setdefault(found["unserved"], []).append(found["bag"])
            return
        facts = found["trial"]
        self.fibre[index], self.trial[index], self.content[index] = facts["fibre"], facts["trial"], facts["content"]
        self._code[index] = self._codes.setdefault(facts["fibre"], len(self._codes))
        self.pca[index] = _number(facts["pca"])
        self.amplitude_l0[index] = _number(facts["amplitude_l0"])
        reference = facts["amplitude_l0"] == 0.0 and facts["recovery_s"] is None
        self.recovery_s[index] = CONDITIONS[0].recovery_s if reference else _number(facts["recovery_s"])
        if facts["stretch_l0"] is not None or not facts["moves"]:
            # What residual force enhancement is looked for in; most trials are of another kind.
            self._shapes[index] = dict(facts)
        _put(self.measured, index, found["measured"])
        for name, values in found["models"].items():
            if name not in self.models:
                self.models[name] = {field: np.full(self._bags, np.nan) for field in MODEL_FIELDS}
            _put(self.models[name], index, values)
            for window in WINDOWS:
                self.models[name][f"rmsd_{window}"][index] = _number(values["rmsd_f0"][window])
            if values.get("pushes"):
                self._pushes.setdefault(name, {})[index] = values["pushes"]
        for name in found["missing"]:
            self.missing.setdefault(name, set()).add(facts["fibre"])
        if found["warnings"]:
            self._warnings[index] = list(found["warnings"])
        told = {name: each["why"] for name, each in {MEASURED: found["measured"], **found["models"]}.items()}
        if any(told.values()):
            self._why[index] = {name: dict(why) for name, why in told.items()}

    @property
    def good(self) -> npt.NDArray[np.bool_]:
        """Which bags could be used, shape (bags,)."""
        usable: npt.NDArray[np.bool_] = self._code >= 0
        return usable

    @property
    def fibres(self) -> list[str]:
        """Names of fibres, sorted."""
        return sorted({fibre for fibre in self.fibre if fibre})

    @property
    def warnings(self) -> list[str]:
        """All warnings in order of the bags, those alike in one; then one for each model that pushes."""
        lines = alike(line for index in sorted(self._warnings) for line in self._warnings[index])
        for told in self._pushes.values():
            lines += one_for_all([told[index] for index in sorted(told) if self._code[index] >= 0])
        return lines

    def why(self, index: int, of: str) -> dict[str, str]:
        """What a trial lacks that could be expected, measured or by a model, and why."""
        return self._why.get(index, {}).get(of, {})

    def refuse(self, index: int, problem: str) -> None:
        """Take a bag out."""
        self.problems[self.bag[index]] = problem
        self.fibre[index] = ""
        self._code[index] = -1
        self._shapes.pop(index, None)

    def problem_lines(self) -> list[str]:
        """A line for each bag that cannot be used, one alone for all whose fibre has no file."""
        shared = {fibre: sorted(bags) for fibre, bags in sorted(self.unserved.items()) if len(bags) > 1}
        alike = {bag for bags in shared.values() for bag in bags}
        lines = [self.problems[bag] for bag in sorted(self.problems) if bag not in alike]
        for bags in shared.values():
            why = self.problems[bags[0]].removeprefix(f"bag {bags[0]}: ")
            lines.append(f"{len(bags)} bags, from {bags[0]} to {bags[-1]}: {why}")
        return lines

    def shapes(self) -> Iterator[dict[str, Any]]:
        """Facts of the trials that are isometric throughout or have one stretch alone, in order of the bags."""
        return (self._shapes[index] for index in sorted(self._shapes))

    def is_of(self, fibre: str) -> npt.NDArray[np.bool_]:
        """Which bags are of a fibre, shape (bags,)."""
        mine: npt.NDArray[np.bool_] = self._code == self._codes.get(fibre, -2)
        return mine


def duplicates(trials: Trials) -> Iterator[tuple[int, str]]:
    """Bags that come a second time, by name or by content: place and what is wrong."""
    names: dict[tuple[str, str], int] = {}
    contents: dict[str, int] = {}
    for i in np.flatnonzero(trials.good).tolist():
        name = (trials.fibre[i], trials.trial[i])
        first = names.setdefault(name, i)
        if first != i:
            told = f"trial {name[1]} of fibre {name[0]} is in {trials.bag[first]} already"
            yield i, f"bag {trials.bag[i]}: {told}; give every trial once"
            continue
        first = contents.setdefault(trials.content[i], i)
        if first != i:
            yield i, f"bag {trials.bag[i]} holds the same samples as {trials.bag[first]}; give every trial once"


def srs_table(trials: Trials, model: str | None, label: str) -> SrsTable | None:
    """SRS and isometric force of the trials of the paper's protocol; repeats of a condition are averaged.

    Args:
        trials: all.
        model: parameter set; None: what was measured.
        label: of the table.

    Returns:
        None where no trial has pCa, amplitude and recovery time.
    """
    values = trials.measured if model is None else trials.models[model]
    used = np.isfinite(trials.pca) & np.isfinite(trials.amplitude_l0) & np.isfinite(trials.recovery_s)
    used &= trials.good
    if not np.any(used):
        return None
    pca = _levels(trials.pca[used], None)
    recovery = _levels(trials.recovery_s[used], RECOVERIES_S)
    amplitude = _levels(trials.amplitude_l0[used], (0.0, *AMPLITUDES_L0))
    places = [
        _places(pca, trials.pca),
        _places(recovery, trials.recovery_s),
        _places(amplitude, trials.amplitude_l0),
    ]
    used &= np.all([p >= 0 for p in places], axis=0)
    shape = (pca.size, recovery.size, amplitude.size)
    fibres, repeats_left_out = {}, 0
    for name in trials.fibres:
        mine = used & trials.is_of(name)
        cell = tuple(p[mine] for p in places)
        (test, test_se, out), (conditioning, conditioning_se, _), (isometric, _, _) = (
            _mean_in_cells(values[q][mine], values[f"{q}_se"][mine], cell, shape)
            for q in ("srs_test", "srs_conditioning", "isometric_f0")
        )
        fibres[name] = FibreSrs(test, conditioning, isometric, test_se, conditioning_se)
        repeats_left_out += out
    return SrsTable(label, pca, recovery, amplitude, fibres, repeats_left_out)


def _levels(values: Array, common: tuple[float, ...] | None) -> Array:
    """Distinct nominal values; the common ones alone where there are too many."""
    levels = np.unique([float(f"{value:.6g}") for value in values])
    if common is not None and levels.size > _MOST_LEVELS:
        return np.array(common)
    return levels


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


def _put(columns: dict[str, Array], index: int, values: Mapping[str, Any]) -> None:
    for name in _READ_OFF:
        columns[name][index], columns[f"{name}_se"][index] = _number(values[name]), _number(values[f"{name}_se"])
    if values["k_tr"] is not None:
        columns["k_tr"][index] = values["k_tr"]["k_per_s"]
        columns["k_tr_se"][index] = _number(values["k_tr"]["se_per_s"])


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)
