"""What a diagnosis is given: for every fibre its file and its trials, of several fibres found by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from xb_muscle_ros.diagnose.conditions import Condition, condition_of, shown
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre, load_fibre
from xb_muscle_ros.scores.stiffness import stiffness_of_phase
from xb_muscle_ros.trials.bag_files import find_bags
from xb_muscle_ros.trials.bag_reading import TrialBag
from xb_muscle_ros.trials.completing import Known, counted
from xb_muscle_ros.trials.study import read_study, trial_of_bag
from xb_muscle_ros.trials.trial import Trial


@dataclass(frozen=True)
class FibreStudy:
    """One fibre of a study.

    Attributes:
        fibre: where its base model starts.
        trials: all with measured force, complete and checked, in the order of recording.
        notes: lines on what the bags did not say, and on what cannot be read off their forces.
    """

    fibre: Fibre
    trials: tuple[Trial, ...]
    notes: tuple[str, ...]


def read_fibres(
    bags: Sequence[str | Path],
    fibers: Sequence[str | Path | Fibre],
    known: Known | None = None,
    only: str | None = None,
) -> tuple[FibreStudy, ...]:
    """Read a study of one fibre or of several.

    With one fibre file its trials are all bags, whatever fibre they name (see `read_study`). With several, a bag's
    trials are those of the fibres that its facts, or its messages, name.

    Args:
        bags: bags or folders of bags, in the order of recording.
        fibers: fibre files, names of fibres that come with the package, or fibres.
        known: what is known of L0 and F0 beside bags and fibre files.
        only: with one fibre: take trials of this fibre and no other.

    Returns:
        one for each fibre file, in their order.

    Raises:
        UserError: one line; bags or files that cannot be read, a fibre twice, fibres without bags, bags of a fibre
            without file, different base models, trials without force, or fibres that share no condition.
    """
    if not bags:
        raise UserError("there are no bags to diagnose; give at least one")
    fibres = [each if isinstance(each, Fibre) else load_fibre(each) for each in fibers]
    _check_files(fibres)
    known = known or Known()
    if len(fibres) == 1:
        study = read_study(bags, fibres[0].name, known.of_file(fibres[0]), only)
        notes = (*study.notes, *_others(bags, fibres[0].name))
        return _checked([FibreStudy(fibres[0], tuple(study.trials), notes)])
    if only is not None:
        raise UserError(
            f"--trials-of {only} takes the trials of one fibre, but there are {len(fibres)} fibre files; with several, "
            "trials are found by the fibre's name; leave --trials-of out"
        )
    return _checked(_by_name(bags, fibres, known))


def given_twice(bags: Sequence[str | Path]) -> list[str]:
    """A line on bags that are named more than once: each is taken once."""
    found = [path for each in bags for path in find_bags([each])]
    places = [path.resolve() for path in found]
    again = dict.fromkeys(str(path) for path, place in zip(found, places, strict=True) if places.count(place) > 1)
    return [f"bags that were given more than once are taken once: {', '.join(again)}"] if again else []


def _check_files(fibres: Sequence[Fibre]) -> None:
    """Each fibre once, and one base model for all."""
    if not fibres:
        raise UserError("there is no fibre file to start from; give one with --fiber")
    names = [f.name for f in fibres]
    for name in names:
        if names.count(name) > 1:
            files = ", ".join(str(f.path) for f in fibres if f.name == name)
            raise UserError(f"fibre '{name}' is given {names.count(name)} times ({files}); give each fibre once")
    for what, option in (("model", "--model"), ("method", "--method")):
        of = {f.name: str(getattr(f, what)) for f in fibres}
        if len(set(of.values())) > 1:
            listed = ", ".join(f"{name}: {value}" for name, value in of.items())
            raise UserError(f"fibre files start from different {what}s, {listed}; give one for all with {option}")


def _by_name(bags: Sequence[str | Path], fibres: Sequence[Fibre], known: Known) -> list[FibreStudy]:
    """Trials of each fibre, from the bags that name it."""
    opened = [(path, TrialBag(path)) for path in find_bags(bags)]
    of_bags = [_fibres_of(bag) for _, bag in opened]
    there = list(dict.fromkeys(name for of in of_bags for name in of))
    files = [fibre.name for fibre in fibres]
    lists = f"fibre files are of {_listed(files)}; bags are of {_listed(there)}"
    without = [name for name in files if name not in there]
    if without:
        raise UserError(f"no bag is of fibre{_s(without)} {_listed(without)}; {lists}; give {_their(without)} bags too")
    for (path, _), of in zip(opened, of_bags, strict=True):
        if not set(of) & set(files):
            more = sum(1 for other in of_bags if not set(other) & set(files)) - 1
            raise UserError(
                f"bag {path} is of fibre{_s(of)} {_listed(list(of))}, which {'have' if len(of) > 1 else 'has'} no "
                f"fibre file{f' (and {more} more bags)' if more else ''}; {lists}; give the file or leave the bag out"
            )
    found = []
    for fibre in fibres:
        mine = [(p, bag, of[fibre.name]) for (p, bag), of in zip(opened, of_bags, strict=True) if fibre.name in of]
        read = [trial_of_bag(bag, channel, known.of_file(fibre), str(path)) for path, bag, channel in mine]
        notes = counted(lines for _, lines in read)
        found.append(FibreStudy(fibre, tuple(trial for trial, _ in read), tuple(notes)))
    return found


def studies_of(trials: Sequence[Trial], fibres: Sequence[Fibre]) -> tuple[FibreStudy, ...]:
    """A study of trials in memory, complete and checked already.

    Args:
        trials: in the order of recording; of one fibre file all of them, of several each fibre's own.
        fibres: where the base models start.

    Raises:
        UserError: see `read_fibres`.
    """
    _check_files(fibres)
    named = list(dict.fromkeys(trial.facts.fibre for trial in trials))
    if len(fibres) == 1:
        return _checked([FibreStudy(fibres[0], tuple(trials), tuple(_others_line(named, fibres[0].name)))])
    files = [fibre.name for fibre in fibres]
    if set(named) != set(files):
        raise UserError(
            f"trials are of fibres {_listed(named)}, fibre files of {_listed(files)}; give files and trials of the same"
        )
    return _checked([FibreStudy(f, tuple(t for t in trials if t.facts.fibre == f.name), ()) for f in fibres])


def _others(bags: Sequence[str | Path], fibre: str) -> list[str]:
    """A line on trials of other fibres, which the one fibre file that was given serves."""
    opened = [TrialBag(path) for path in find_bags(bags)]
    return _others_line([next(iter(_fibres_of(bag))) for bag in opened if len(bag.fibres) == 1], fibre)


def _others_line(named: Sequence[str], fibre: str) -> list[str]:
    """The line of `_others`, where there is one."""
    others = list(dict.fromkeys(name for name in named if name != fibre))
    if not others:
        return []
    return [f"trials of fibre{_s(others)} {', '.join(others)} are diagnosed as those of {fibre}, the one file given"]


def _fibres_of(bag: TrialBag) -> dict[str, str]:
    """Names of a bag's fibres, and what its messages call them: a bag of one fibre may call it otherwise."""
    if len(bag.fibres) == 1:
        return {bag.named or bag.fibres[0]: bag.fibres[0]}
    return {name: name for name in bag.fibres}


def _checked(studies: Sequence[FibreStudy]) -> tuple[FibreStudy, ...]:
    """Studies that can be diagnosed together; see `_with_forces` and `_check_conditions`."""
    checked = tuple(_with_forces(study) for study in studies)
    if len(checked) > 1:
        _check_conditions(checked)
    return checked


def _with_forces(study: FibreStudy) -> FibreStudy:
    """The study, its forces there, with a line on stiffness that cannot be measured.

    Raises:
        UserError: a trial has no measured force, or nothing but 0 N.
    """
    name = study.fibre.name
    bare = [trial.facts.trial for trial in study.trials if not trial.force_n.size]
    if bare:
        named = f"trial{_s(bare)} {', '.join(bare)} {'have' if len(bare) > 1 else 'has'}"
        raise UserError(f"fibre {name}: {named} no measured force; a diagnosis needs it, leave the bag{_s(bare)} out")
    for trial in study.trials:
        if not np.any(trial.force_n):
            raise UserError(
                f"trial {trial.facts.trial}: measured force is 0 N in all {trial.force_n.size} samples; check the "
                "force channel, or leave the bag out"
            )
    return replace(study, notes=(*study.notes, *_stiffness_lines(study.trials)))


def _stiffness_lines(trials: Sequence[Trial]) -> list[str]:
    """A line on stretches whose short-range stiffness cannot be measured, and why."""
    why: dict[str, str] = {}
    stretched = 0
    for trial in trials:
        phases = trial.phases_by_name()
        length = np.interp(trial.force_time_s, trial.time_s, trial.length_change_l0)
        of = [phases[name] for name in ("conditioning_stretch", "test_stretch") if name in phases]
        stretched += bool(of)
        for phase in of:
            found = stiffness_of_phase(trial.force_time_s, length, trial.measured_f0, phase)
            if found.value is None:
                why.setdefault(trial.facts.trial, found.why)
    if not why:
        return []
    first, reason = next(iter(why.items()))
    return [f"SRS cannot be measured in {len(why)} of {stretched} stretched trials (in {first}: {reason})"]


def _check_conditions(studies: Sequence[FibreStudy]) -> None:
    """Every fibre has a condition that another has too.

    Raises:
        UserError: one has none; says what each has.
    """
    of: dict[str, list[Condition]] = {s.fibre.name: [condition_of(t) for t in s.trials] for s in studies}
    for name, own in of.items():
        others = [c for other, theirs in of.items() if other != name for c in theirs]
        if not any(a.is_like(b) for a in own for b in others):
            listed = "; ".join(f"{fibre} has {shown(conditions)}" for fibre, conditions in of.items())
            raise UserError(
                f"fibre {name} shares no condition (pCa and protocol) with another fibre, so that they tell nothing of "
                f"each other: {listed}; diagnose it by itself"
            )


def _listed(names: Sequence[str]) -> str:
    return ", ".join(f"'{name}'" for name in names)


def _s(names: Sequence[str] | dict[str, str]) -> str:
    return "s" if len(names) > 1 else ""


def _their(names: Sequence[str]) -> str:
    return "their" if len(names) > 1 else "its"
