"""What physics a simulation left out of recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from xb_muscle_ros.api.inputs import FibreLike, TrialsLike, kept, known_of, paths_and_trials, picked, work_of
from xb_muscle_ros.api.tables import dataframe, drawn
from xb_muscle_ros.api.telling import Lines, Tell
from xb_muscle_ros.diagnose.component import Component
from xb_muscle_ros.diagnose.error_sds import error_sd_lines, error_sds_of
from xb_muscle_ros.diagnose.intake import given_twice, read_fibres, studies_of
from xb_muscle_ros.diagnose.outputs import Files, older_results, write
from xb_muscle_ros.diagnose.report.prose import headline, summary
from xb_muscle_ros.diagnose.report.terminal import terminal_text
from xb_muscle_ros.diagnose.result import Diagnosis
from xb_muscle_ros.diagnose.run import diagnose as diagnosed
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import refuse_older
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.trials.trial import Trial

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False, eq=False)
class DiagnosisResult:
    """What a diagnosis found.

    Attributes:
        diagnosis: the record that ``diagnosis.json`` holds (docs/diagnose.md): verdict, components with probabilities,
            shares (0 to 1), held-out scores, residuals (F0), places (s), parameters in their units.
        augmented: fibres with the mechanisms of the answer, by file name; `simulate`, `replay` and `Muscle` take them.
        next_experiment: protocol to record next, in the first fibre's units; None where nothing is to be separated.
        warnings: lines on what was taken for granted, and on what the answer may be wrong about.
        files: what `save` writes beside the record.
    """

    diagnosis: Diagnosis
    augmented: Mapping[str, Fibre]
    next_experiment: Trial | None
    warnings: tuple[str, ...]
    files: Files

    def __repr__(self) -> str:
        answer = ", ".join(self.answer) or "nothing"
        return f"DiagnosisResult({', '.join(self.diagnosis.fibres)}: {self.diagnosis.verdict.value}, answer: {answer})"

    def __str__(self) -> str:
        """Headline, summary and table of components, as ``xb_muscle diagnose`` prints them."""
        return terminal_text(self.diagnosis)

    @property
    def verdict(self) -> str:
        """``none``, ``measurement``, ``parameters``, ``physics``, ``ambiguous`` or ``unexplained``."""
        return self.diagnosis.verdict.value

    @property
    def answer(self) -> tuple[str, ...]:
        """Mechanisms that the base lacks, best first; empty where none is named."""
        return self.diagnosis.answer

    @property
    def components(self) -> tuple[Component, ...]:
        """All candidates with their probabilities (0 to 1), the most probable first."""
        return self.diagnosis.components

    @property
    def headline(self) -> str:
        """The answer in one sentence."""
        return headline(self.diagnosis)

    @property
    def summary(self) -> str:
        """The answer in a paragraph."""
        return " ".join(summary(self.diagnosis))

    def to_dataframe(self) -> pd.DataFrame:
        """Candidates, a row each, the most probable first; columns as the fields of a component in ``diagnosis.json``.

        Raises:
            UserError: pandas is not there.
        """
        return dataframe({**asdict(each), "kind": each.kind.value} for each in self.components)

    def plot(self, which: str = "before_after") -> Figure:
        """One of the report's figures.

        Args:
            which: ``before_after`` (force and its error), ``probabilities``, ``contributions``, ``fibres``,
                ``map`` or ``laws``.

        Returns:
            a Matplotlib figure.

        Raises:
            UserError: this diagnosis has no such figure.
        """
        from xb_muscle_ros.diagnose.report.figures import FIGURES

        if which not in FIGURES:
            raise UserError(f"figure '{which}' is not known; known: {', '.join(FIGURES)}")
        try:
            return drawn(lambda: FIGURES[which](self.diagnosis, self.files.traces))
        except UserError:
            raise UserError(f"this diagnosis has nothing to show in figure '{which}'") from None

    def save(self, folder: str | Path, *, overwrite: bool = False) -> tuple[Path, ...]:
        """Write report, ``diagnosis.json``, traces, augmented fibre files and the next experiment's bag.

        Args:
            folder: made if need be.
            overwrite: replace the files of an older diagnosis.

        Returns:
            page, JSON and fibre files.

        Raises:
            UserError: an older diagnosis is there, or the folder cannot be written.
        """
        out = Path(folder)
        refuse_older(older_results(out), overwrite)
        write(out, self.diagnosis, self.files)
        return tuple(out / name for name in ("report.html", "diagnosis.json", *self.diagnosis.augmented.values()))


def diagnose(
    trials: TrialsLike,
    fibre: FibreLike | Sequence[FibreLike],
    *,
    model: str | None = None,
    method: str | None = None,
    reference_length: str | float | None = None,
    f0: str | float | None = None,
    trials_of: str | None = None,
    features: str | Path | None = None,
    predict: str | Path | None = None,
    nuisance: Mapping[str, float] | Sequence[str] = (),
    quick: bool = False,
    seed: int = 1,
    processes: int | None = None,
    scheduler: str | None = None,
    journal: str | Path | None = None,
    progress: bool = False,
    tell: Tell | None = None,
) -> DiagnosisResult:
    """Say what physics a simulation left out of recordings, where it shows, and how sure that is.

    Args:
        trials: bags, folders of bags, `Trial` objects, or what `simulate` returned; in the order of recording, with
            measured force.
        fibre: name, fibre file or `Fibre` that the base model starts from; several fibres make one study, their trials
            are found by the fibre's name.
        model: parameter set of the fibre files; None: the one that the files name.
        method: how heads are distributed over strain; None: the files'.
        reference_length: see `read_trials`; of bags only.
        f0: see `read_trials`; of bags only.
        trials_of: see `read_trials`; of bags only.
        features: JSON table of measured SRS (F0/L0) and isometric force (F0) to be met beside the traces.
        predict: such a table that is predicted and compared, never fitted.
        nuisance: SDs of ordinary measurement errors where the study knows better, by name, such as
            ``{"time_shift": 0.002}`` (s).
        quick: look less hard: minutes become tens of seconds.
        seed: of the bootstrap.
        processes: see `fit`.
        scheduler: see `fit`.
        journal: see `fit`.
        progress: see `fit`.
        tell: hears each warning; None: a `DataWarning` each.

    Returns:
        verdict, components with their probabilities, augmented fibres; forces in F0, lengths in L0, times in s.

    Raises:
        UserError: see `read_trials`; trials that do not belong together, no force, no solution at the start.

    Source:
        method: docs/diagnose.md; how often it is right: docs/prove.md.

    Examples:
        >>> import xb_muscle_ros as xb
        >>> xb.diagnose([], "18Dec2017a")
        Traceback (most recent call last):
            ...
        xb_muscle_ros.errors.UserError: there are no bags to diagnose; give at least one
    """
    work = work_of(processes, scheduler, journal, progress)
    sds = dict(nuisance) if isinstance(nuisance, Mapping) else error_sds_of(nuisance)
    error_sd_lines(sds)
    several: Sequence[FibreLike] = [fibre] if isinstance(fibre, (str, Path, Fibre)) else list(fibre)
    fibres = [picked(each, model, method) for each in several]
    known = known_of(reference_length, f0)
    paths, in_memory = paths_and_trials(trials)
    if in_memory:
        studies = studies_of(kept(in_memory, known, trials_of), fibres)
    else:
        studies = read_fibres(paths, fibres, known=known, only=trials_of)
    found, files = diagnosed(studies, quick, seed, work, features, predict, sds)
    found = replace(found, notes=(*found.notes, *given_twice(paths)))
    lines = Lines(tell)
    lines.say(*found.warnings, *found.notes)
    return DiagnosisResult(found, files.augmented, files.protocol, tuple(lines), files)
