"""A protocol through a model, and through recordings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial

from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.protocols.base import MEASURED, Found, NoAnswer, Planned, Protocol, Run, measured
from xb_muscle_ros.scores.estimate import Estimate, notes_of, without_numbers
from xb_muscle_ros.trials.trial import Trial


def analysed(protocol: Protocol, fibre: str, of: str, runs: Sequence[Run], lacking: Sequence[str] = ()) -> Found:
    """What a protocol reads off runs; whatever a cell of the table has to say is a note.

    Args:
        lacking: notes on what there is no run of.
    """
    found = protocol.analyse(fibre, of, runs)
    said = "\n".join(without_numbers(note) for note in found.notes)
    told = [
        (str(row.get("trial", "")), f"{column.text}: {cell.why}")
        for row in found.rows
        for key, column in protocol.columns.items()
        if isinstance(cell := row.get(key), Estimate) and cell.why and without_numbers(cell.why) not in said
    ]
    return replace(found, notes=(*lacking, *found.notes, *notes_of(told)))


def answers(
    protocol: Protocol,
    fibre: Fibre,
    planned: Sequence[Planned],
    settle_s: float | None = None,
    as_measured: bool = False,
    lacking: list[str] | None = None,
) -> Iterator[Run]:
    """The planned trials through a model, one after the other.

    Args:
        as_measured: the force counts as measured.
        lacking: gets a line for each trial to which the model has no answer, where it has one to others.

    Raises:
        UserError, StateViolation: see `Protocol.answer`.
    """
    muscle = Muscle(fibre)
    asked = (partial(protocol.answer, muscle, each, settle_s) for each in planned)
    for run in answered(asked, lacking):
        yield with_force(run, fibre, as_measured)


def answered(asked: Iterable[Callable[[], Run]], lacking: list[str] | None) -> Iterator[Run]:
    """Answers that there are, to questions asked one after the other.

    Args:
        lacking: see `answers`.

    Raises:
        NoAnswer: there is none at all, or none for one of them and no `lacking`.
    """
    problems: list[str] = []
    any_answer = False
    for ask in asked:
        try:
            run = ask()
        except NoAnswer as problem:
            if lacking is None:
                raise
            lacking.append(f"{problem}; the trial is left out")
            problems.append(str(problem))
            continue
        any_answer = True
        yield run
    if problems and not any_answer:
        raise NoAnswer("; ".join(problems))


def with_force(run: Run, fibre: Fibre, as_measured: bool) -> Run:
    """A model's run whose trial has the model's force and says whose it is."""
    assert run.simulated is not None  # a recording has its force
    source = f"simulated: fibre {fibre.name}, model {fibre.model}, method {fibre.method}"
    trial = replace(
        run.trial,
        facts=replace(run.trial.facts, source=source),
        force_time_s=run.simulated.time_s,
        force_n=run.simulated.force_n,
        force_is_measured=as_measured,
    )
    return replace(run, trial=trial)


def read_measured(protocol: Protocol, fibre: str, trials: Sequence[Trial]) -> Found:
    """What recordings of one fibre show; those without force are left out and named in a note."""
    having = [trial for trial in trials if trial.force_time_s.size]
    lacking = [trial.facts.trial for trial in trials if not trial.force_time_s.size]
    notes = [f"trial {name} has no measured force and is left out" for name in lacking]
    return analysed(protocol, fibre, MEASURED, [measured(trial) for trial in having], notes)


def read_model(protocol: Protocol, fibre: Fibre, trials: Sequence[Trial], settle_s: float | None = None) -> Found:
    """What a model shows that is given what the recorded fibre was given.

    Raises:
        UserError, StateViolation: see `Protocol.repeat`.
    """
    muscle = Muscle(fibre)
    lacking: list[str] = []
    asked = (partial(protocol.repeat, muscle, trial, settle_s) for trial in trials)
    name = trials[0].facts.fibre
    try:
        runs = list(answered(asked, lacking))
    except NoAnswer:
        return Found(name, fibre.model, (), notes=tuple(lacking))
    return analysed(protocol, name, fibre.model, runs, lacking)
