"""Paths of bags turned into trials that are complete and checked: the one way in for every command."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.bag_files import find_bags
from xb_muscle_ros.trials.bag_reading import Reading, TrialBag
from xb_muscle_ros.trials.between_samples import with_corners
from xb_muscle_ros.trials.checks import check_values
from xb_muscle_ros.trials.completing import Known, complete, counted
from xb_muscle_ros.trials.trial import Trial

_BAG = re.compile(r"bag (.*?): ")
_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_NAMED = 3


class Study(NamedTuple):
    """Trials of a run in the order of the bags, and the lines that hold for several of them."""

    trials: list[Trial]
    notes: list[str]

    @property
    def lines(self) -> list[str]:
        """All there is to say to the user: the notes, then the trials' own warnings, those alike in one."""
        return [*self.notes, *alike(line for trial in self.trials for line in trial.warnings)]


def read_study(paths: Iterable[str | Path], fibre: str, known: Known, only: str | None = None) -> Study:
    """Read the trials of some bags.

    Of a bag of one fibre the trial is taken, whatever its name. Of a bag of several, the trial of the fibre that is
    asked for; else of the one that its facts are of.

    Args:
        fibre: name of the fibre whose parameters are used.
        only: take trials of this fibre and no other.

    Raises:
        UserError: a bag cannot be read, has no trial of the fibre, or has values that no muscle has.
    """
    trials, notes = [], []
    for path in find_bags(paths):
        bag = TrialBag(path)
        chosen = _chosen(bag, fibre, only)
        others = [name for name in bag.fibres if name != chosen]
        reading = bag.reading(chosen)
        del bag  # its messages take as much memory as the trial
        trial, told = trial_of(reading, known, str(path))
        del reading
        if others:
            told = (*told, left_out(chosen, others))
        trials.append(trial)
        notes.append(told)
    return Study(trials, counted(notes))


def trial_of_bag(bag: TrialBag, fibre: str, known: Known, where: str) -> tuple[Trial, tuple[str, ...]]:
    """One fibre's trial, complete and checked, and lines on what is not the bag's own.

    Raises:
        UserError: see `TrialBag.reading` and `check_values`.
    """
    return trial_of(bag.reading(fibre), known, where)


def trial_of(reading: Reading, known: Known, where: str) -> tuple[Trial, tuple[str, ...]]:
    """The same of what a bag has.

    Corners of length that lie between samples are put back here, so that every command simulates the same lengths.

    Raises:
        UserError: see `check_values`.
    """
    trial, notes = complete(reading, known)
    told = "f0_n" not in reading.unknown or known.f0_n is not None or known.file_f0_n != 1.0
    lines = check_values(trial, where, told, "pca" not in reading.unknown)
    finer = with_corners(trial)
    if finer is not trial:
        notes = (*notes, "corners of length between samples were recovered")
    return replace(finer, warnings=(*trial.warnings, *lines)), notes


def left_out(chosen: str, others: Iterable[str]) -> str:
    """The line on fibres of a bag that are not taken."""
    names = ", ".join(f"'{name}'" for name in others)
    return f"the bag is of several fibres; taken: '{chosen}', left out: {names}; --trials-of takes another"


def _chosen(bag: TrialBag, fibre: str, only: str | None) -> str:
    alone = len(bag.fibres) == 1
    if only is None and alone:
        return bag.fibres[0]
    names = [only] if only is not None else [fibre, bag.named]
    for name in names:
        if name is not None and (name in bag.fibres or (alone and name == bag.named)):
            return bag.fibres[0] if alone else name
    listed = ", ".join(f"'{name}'" for name in bag.fibres)
    remedy = "--trials-of takes one of them"
    raise UserError(f"bag {bag.path} is of {'fibre' if alone else 'fibres'} {listed}, not of '{names[0]}'; {remedy}")


def alike(lines: Iterable[str]) -> list[str]:
    """Lines in their order; of those that differ in their bag and in numbers alone, the first, which names the others.

    Args:
        lines: begin with ``bag PATH: `` where they are of one bag; any other stays as it is.
    """
    first: dict[str, str] = {}
    others: dict[str, list[str]] = {}
    for line in lines:
        bag = _BAG.match(line)
        key = line if bag is None else _NUMBER.sub("0", line[bag.end() :])
        if key not in first:
            first[key] = line
        elif bag is not None:
            others.setdefault(key, []).append(Path(bag.group(1)).name)
    return [line + _likewise(others.get(key, [])) for key, line in first.items()]


def _likewise(bags: list[str]) -> str:
    if not bags:
        return ""
    named = ", ".join(bags[:_NAMED]) + (", ..." if len(bags) > _NAMED else "")
    return f" (likewise {len(bags)} more bag{'s' if len(bags) > 1 else ''}: {named})"
