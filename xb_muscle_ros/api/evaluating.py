"""Models against recordings and against the paper."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from xb_muscle_ros.api.inputs import FibreLike, TrialsLike, kept, known_of, paths_and_trials, work_of, write_trials
from xb_muscle_ros.api.tables import dataframe, drawn
from xb_muscle_ros.api.telling import Lines, Tell
from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.evaluate.csv_rows import tables
from xb_muscle_ros.evaluate.report import comparison_table, force_table, srs_table_text
from xb_muscle_ros.evaluate.request import Request
from xb_muscle_ros.evaluate.results import Results
from xb_muscle_ros.evaluate.run import evaluate as evaluated
from xb_muscle_ros.evaluate.writing import draw_figures, older_results, write
from xb_muscle_ros.files import plain_tree, refuse_older
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.fibre_writing import write_fibre
from xb_muscle_ros.models.registry import METHODS, split_set
from xb_muscle_ros.trials.bag_files import plain
from xb_muscle_ros.trials.trial import Trial

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False, eq=False)
class EvaluationResult:
    """What an evaluation found.

    Attributes:
        found: what ``evaluate.json`` holds (docs/evaluate.md): force RMSD (F0), SRS (F0/L0), AIC, paired tests.
        warnings: lines on what was left out or taken for granted.
        results: trials and tables behind it.
        request: what was asked for.
    """

    found: Mapping[str, Any]
    warnings: tuple[str, ...]
    results: Results
    request: Request

    def __repr__(self) -> str:
        models = ", ".join(each.model for each in self.results.sections.sets) or "no models"
        trials = self.found.get("trials", {}).get("used", 0)
        return f"EvaluationResult({trials} trials; {models})"

    def __str__(self) -> str:
        """The tables that ``xb_muscle evaluate`` prints."""
        found, parts = self.results.sections, []
        if found.force_rmsd is not None and found.force_rmsd.overall:
            parts.append(f"force RMSD, fibre means ± s.d.\n\n{force_table(found.force_rmsd)}\n")
        if found.paper is not None:
            head = "beside the paper (= to 0.01 or within its bound, ≠ not)"
            parts.append(f"{head}\n\n{comparison_table(found.paper)}\n")
        if found.srs is not None:
            for reading in found.srs.shown:
                head = f"RMSD of relative SRS, reading '{reading}'"
                parts.append(f"{head}\n\n{srs_table_text(found.srs, reading)}\n")
            if found.srs.shown and found.srs.aic_note:
                parts.append(found.srs.aic_note + "\n")
        return "\n".join(parts)

    def to_dataframe(self, table: str = "trials") -> pd.DataFrame:
        """One of the tables; columns as in the CSV file of its name.

        Args:
            table: ``trials``, ``force_rmsd``, ``relative_srs``, ``srs_cells`` or ``srs_rmsd``.

        Raises:
            UserError: pandas is not there, or the evaluation has no such table.
        """
        rows = tables(self.results)
        if table not in rows:
            raise UserError(f"table '{table}' is not among those of this evaluation{suggest(table, rows)}")
        return dataframe(rows[table])

    def plot(self, which: str | None = None) -> Figure:
        """One of the figures that ``xb_muscle evaluate`` draws.

        Args:
            which: ``force_rmsd``, ``relative_srs`` or ``srs_surfaces``; None: the first that there is.

        Returns:
            a Matplotlib figure.

        Raises:
            UserError: the evaluation has no such figure.
        """
        return drawn(lambda: draw_figures(Path(), self.results), which)

    def save(self, folder: str | Path, *, overwrite: bool = False) -> tuple[Path, ...]:
        """Write ``evaluate.json``, ``evaluate.md``, CSV tables and figures, as ``xb_muscle evaluate`` does.

        Args:
            folder: made if need be.
            overwrite: replace the files of an older evaluation.

        Returns:
            files to look at.

        Raises:
            UserError: an older evaluation is there, or the folder cannot be written.
        """
        refuse_older(older_results(Path(folder)), overwrite)
        return tuple(write(replace(self.request, out=Path(folder)), self.results))


def evaluate(
    trials: TrialsLike = (),
    *,
    fibre: FibreLike | Sequence[FibreLike] = (),
    model: str | Sequence[str] | None = None,
    method: str | None = None,
    reference_length: str | float | None = None,
    f0: str | float | None = None,
    trials_of: str | None = None,
    settle: float | None = None,
    measured_only: bool = False,
    skip_bad: bool = False,
    empirical: str | Path | None = None,
    golden: str | Path | None = None,
    processes: int | None = None,
    scheduler: str | None = None,
    out: str | Path | None = None,
    progress: bool = False,
    tell: Tell | None = None,
) -> EvaluationResult:
    """Score models over recordings, and set them beside the paper.

    Args:
        trials: bags, folders of bags, `Trial` objects, or what `simulate` returned. Empty where `empirical` is given.
        fibre: names, fibre files or `Fibre`, one or several; empty: the package's file of a trial's fibre.
        model: parameter sets, one or several; None: all that the fibre files have.
        method: how heads are distributed over strain; None: the files'.
        reference_length: see `read_trials`; of bags only.
        f0: see `read_trials`; of bags only.
        trials_of: see `read_trials`; of bags only.
        settle: isometric time before each trial, s; None: until at rest.
        measured_only: the recordings alone, without models.
        skip_bad: leave recordings that cannot be evaluated out, in place of refusing all.
        empirical: JSON table of measured SRS; asks for the paper's grid of conditions.
        golden: JSON table of the authors' output, to be compared.
        processes: see `fit`.
        scheduler: see `fit`.
        progress: see `fit`.
        out: folder that keeps finished work, so that an interrupted evaluation goes on where it was; None: nothing is
            kept.
        tell: hears each line on what was left out or taken for granted; None: a `DataWarning` each.

    Returns:
        scores of each model; forces in F0, stiffness in F0/L0.

    Raises:
        UserError: see `read_trials`; options against each other.
        StateViolation: a state left its bounds.

    Source:
        scores and tables of van der Zee et al. 2026; see docs/evaluate.md.

    Examples:
        >>> import xb_muscle_ros as xb
        >>> made = xb.simulate("18Dec2017a", recovery=0.1)
        >>> found = xb.evaluate(made, model="3state_coop", processes=0, tell=lambda line: None)
        >>> found
        EvaluationResult(1 trials; 3state_coop)
    """
    paths, in_memory = paths_and_trials(trials)
    fibres = (fibre,) if isinstance(fibre, (str, Path, Fibre)) else tuple(fibre)
    models = (model,) if isinstance(model, str) else model
    if golden is not None and empirical is None:
        raise UserError("--golden is compared with --paper only; add --paper --empirical JSON")
    if not (paths or in_memory) and empirical is None:
        raise UserError("there is nothing to evaluate; give bags, or --paper --empirical JSON")
    if measured_only and (empirical is not None or models or fibres):
        raise UserError("--measured-only has no models; drop it, or --paper, --model and --fiber")
    if settle is not None and not 0.0 < settle <= 1e6:
        raise UserError(f"--settle is {settle:g} s; allowed is above 0 to 1e6")
    for name in models or ():
        split_set(name)
    if method is not None and method not in METHODS:
        raise UserError(f"method '{method}' is not known; known: {', '.join(METHODS)}")
    known, lines = known_of(reference_length, f0), Lines(tell)
    work = work_of(processes, scheduler, None, progress)
    # Tasks read bags and fibre files wherever they run, so what is in memory becomes files for as long as they do.
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        bags = _as_bags(kept(in_memory, known, trials_of), folder) if in_memory else paths
        request = Request(
            bags=tuple(str(path) for path in bags),
            fibres=tuple(_as_file(each, folder) for each in fibres),
            models=None if models is None else tuple(models),
            method=method,
            settle_s=settle,
            measured_only=measured_only,
            skip_bad=skip_bad,
            empirical=None if empirical is None else Path(empirical),
            golden=None if golden is None else Path(golden),
            out=folder if out is None else Path(out),
            work=work,
            known=known,
            only=trials_of,
        )
        results = evaluated(request, lines.say)
    lines.say(*results.warnings)
    return EvaluationResult(plain_tree(results.sections), tuple(lines), results, request)


def _as_bags(trials: Sequence[Trial], folder: Path) -> tuple[Path, ...]:
    """Trials as bags, as the tasks of an evaluation read them; a model's force counts as measured."""
    return write_trials([replace(trial, force_is_measured=True) for trial in trials], folder / "trials")


def _as_file(fibre: FibreLike, folder: Path) -> str:
    if not isinstance(fibre, Fibre):
        return str(fibre)
    write_fibre(folder / f"{plain(fibre.name)}.yaml", fibre)
    return str(folder / f"{plain(fibre.name)}.yaml")
