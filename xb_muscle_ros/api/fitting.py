"""Parameters of a fibre from its recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from xb_muscle_ros.api.inputs import FibreLike, TrialsLike, fibre_of, known_of, paths_and_trials, work_of
from xb_muscle_ros.api.inputs import trials_of as read
from xb_muscle_ros.api.tables import dataframe, drawn
from xb_muscle_ros.api.telling import Lines, Tell
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import matching, refuse_older, write_json
from xb_muscle_ros.fit.asked import choices_of, nuisances_of, starting_fibre, with_population
from xb_muscle_ros.fit.coordinates import fault_coordinates, parameter_coordinates
from xb_muscle_ros.fit.data import fit_trials
from xb_muscle_ros.fit.features import F0_ANCHOR, Feature, measured
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.report import as_json, write_fitted
from xb_muscle_ros.fit.run import Fitted, Settings
from xb_muscle_ros.fit.run import fit as fitted_to
from xb_muscle_ros.fit.split import held_out
from xb_muscle_ros.fit.start import start_lines
from xb_muscle_ros.fit.table import table
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.trials.bag_files import remove_results

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

# What a fit leaves beside the fibre file and its journal.
_WRITTEN = (r"fit\.json", r"trials(_\d+)?\.(png|pdf)", r"(features|profiles|correlation)\.(png|pdf)")


@dataclass(frozen=True, repr=False, eq=False)
class FitResult:
    """What a fit found.

    Attributes:
        fibre: with the fitted parameters; `simulate`, `replay` and `Muscle` take it.
        found: what ``fit.json`` holds (docs/fit.md): parameters with intervals, RMSD (F0) of training and held-out
            trials, correlations, warnings.
        table: the same as text.
        warnings: lines on what was taken for granted, and on how sure the fit is.
        fitted: the fit itself, with its problem and covariance.
    """

    fibre: Fibre
    found: Mapping[str, Any]
    table: str
    warnings: tuple[str, ...]
    fitted: Fitted

    def __repr__(self) -> str:
        moved = [r for r in self.found["parameters"] if r["group"] is None]
        named = ", ".join(f"{row['name']}={row['value']:.4g}" for row in moved[:4]) + (", …" if len(moved) > 4 else "")
        error = self.found["train_rmsd_f0"]
        told = "" if error is None else f", training RMSD {100.0 * error:.3f} % F0"
        return f"FitResult({self.fibre.name}, {self.fibre.model}: {named}{told})"

    @property
    def values(self) -> dict[str, float]:
        """Fitted parameters by name, in the units of ``xb_muscle parameters``."""
        return {row["name"]: row["value"] for row in self.found["parameters"] if row["group"] is None}

    def to_dataframe(self) -> pd.DataFrame:
        """Parameters and measurement errors, a row each.

        Columns: ``name``, ``group``, ``unit``, ``start``, ``value``, ``sd``, ``lower``, ``upper`` (ends of the
        interval), ``interval_kind``, ``at_bound``.

        Raises:
            UserError: pandas is not there.
        """
        same = ("name", "group", "unit", "start", "value", "sd")
        return dataframe(
            {
                **{key: row[key] for key in same},
                "lower": row["interval"][0],
                "upper": row["interval"][1],
                "interval_kind": row["interval_kind"],
                "at_bound": row["at_bound"],
            }
            for row in self.found["parameters"]
        )

    def plot(self, which: str = "trials") -> Figure:
        """One of the figures that ``xb_muscle fit`` draws.

        Args:
            which: ``trials`` (force and residual), ``profiles``, ``correlation`` or ``features``; further pages are
                ``trials_2`` and so on.

        Returns:
            a Matplotlib figure.

        Raises:
            UserError: the fit has no such figure.
        """
        from xb_muscle_ros.fit.figures.pages import draw

        return drawn(lambda: draw(Path(), self.fitted, self.found), which)

    def save(self, out: str | Path, *, overwrite: bool = False) -> tuple[Path, ...]:
        """Write the fibre file and, in the folder of its name, ``fit.json`` and figures, as ``xb_muscle fit`` does.

        Args:
            out: the fibre file, ending in ``.yaml``.
            overwrite: replace the results of an older fit.

        Returns:
            figures, ``fit.json`` and the fibre file.

        Raises:
            UserError: an older fit is there, or the folder cannot be written.
        """
        from xb_muscle_ros.fit.figures.pages import draw

        file = Path(out)
        folder = check_out(file, overwrite)
        found = {**self.found, "provenance": {**self.found["provenance"], "json": f"{folder.name}/fit.json"}}
        remove_results(matching(folder, *_WRITTEN))
        write_json(folder / "fit.json", found)
        figures = draw(folder, self.fitted, found)
        write_fitted(file, self.fitted, found)
        return (*figures, folder / "fit.json", file)


def check_out(out: Path, overwrite: bool) -> Path:
    """The folder beside a fibre file to be written.

    Raises:
        UserError: no name of a fibre file, or results of an older fit that may not be replaced.
    """
    if out.suffix not in (".yaml", ".yml"):
        raise UserError(f"--out is {out}; needed is the name of a fibre file, ending in .yaml")
    folder = out.with_suffix("")
    refuse_older([*([out] if out.exists() else []), *matching(folder, *_WRITTEN)], overwrite)
    return folder


def fit(
    trials: TrialsLike,
    fibre: FibreLike,
    *,
    model: str | None = None,
    method: str | None = None,
    set: Mapping[str, float] | None = None,
    reference_length: str | float | None = None,
    f0: str | float | None = None,
    trials_of: str | None = None,
    hold_out: Sequence[str] = (),
    train: Sequence[str] = (),
    split: str | None = None,
    window: str = "paper",
    weight: Mapping[str, float] | None = None,
    free: Sequence[str] | None = None,
    fix: Sequence[str] = (),
    tie: Mapping[str, str] | None = None,
    bound: Mapping[str, tuple[float, float]] | None = None,
    prior: Mapping[str, tuple[float, float]] | None = None,
    nuisance: str | Sequence[str] | None = None,
    prior_fibers: Sequence[str | Path] = (),
    features: str | Path | None = None,
    features_of: str | None = None,
    force_pca_only: bool = False,
    anchor: bool = True,
    starts: int = 4,
    seed: int = 1,
    level: float = 0.95,
    intervals: bool = True,
    processes: int | None = None,
    scheduler: str | None = None,
    journal: str | Path | None = None,
    progress: bool = False,
    tell: Tell | None = None,
) -> FitResult:
    """Estimate a fibre's parameters from recordings, and how well each one is known.

    Args:
        trials: bags, folders of bags, `Trial` objects, or what `simulate` returned; of one fibre, in the order of
            recording, with measured force. Empty where `features` are all there is to meet.
        fibre: where the fit starts: name, fibre file or `Fibre`.
        model: see `replay`.
        method: see `replay`.
        set: see `replay`.
        reference_length: see `read_trials`; of bags only.
        f0: see `read_trials`; of bags only.
        trials_of: see `read_trials`; of bags only.
        hold_out: rules ``KEY=VALUE`` with KEY one of ``trial`` (with ``*`` and ``?``), ``pca``, ``amplitude`` (L0),
            ``recovery`` (s): trials that meet one are kept out of the fit.
        train: rules: only trials that meet one are fitted.
        split: ``paper``: the paper's two protocols are fitted, the others held out.
        window: force that counts: ``paper`` or ``whole``.
        weight: of trials, by name; 1 where not given.
        free: parameters to fit; None: those the paper fitted, and those of mechanisms.
        fix: parameters that keep their start value.
        tie: parameter -> parameter whose value it takes.
        bound: lower and upper bound by parameter, in its unit.
        prior: mean and SD by parameter; of positive parameters log-normal with SD as a share; ``inf``: none.
        nuisance: measurement errors to fit beside the parameters: names, ``NAME=SD``, ``ordinary``, ``all`` or
            ``none``; None: ``ordinary``.
        prior_fibers: priors from what these other fibres' sets are like.
        features: JSON table of measured SRS (F0/L0) and isometric force (F0) to meet as well.
        features_of: whose features; None: the fibre of the trials.
        force_pca_only: of the features, isometric force alone.
        anchor: ask for an isometric force of 1 F0 (SD 0.02) at pCa 4.5.
        starts: descents from different points.
        seed: of the random starts.
        level: of the intervals.
        intervals: profile every parameter, the longest part of the work; False: intervals of the curvature.
        processes: of this machine; None: one per core, 0: this process.
        scheduler: address of a Dask scheduler whose workers do the work.
        journal: file that keeps finished work, so that an interrupted fit goes on where it was.
        progress: show progress on stderr.
        tell: hears each line on what was taken for granted; None: a `DataWarning` each.

    Returns:
        the fitted fibre, its parameters with intervals, errors of every trial.

    Raises:
        UserError: see `read_trials`; nothing to fit, an unknown parameter, malformed rules, no solution at the start.

    Source:
        free parameters, windows and split of van der Zee et al. 2026; see docs/fit.md.

    Examples:
        >>> import xb_muscle_ros as xb
        >>> exact = {"smoothing": 0.0}
        >>> made = xb.simulate("18Dec2017a", set={**exact, "f": 95.0}, pca=[4.5, 6.1], recovery=0.1)
        >>> found = xb.fit(made, "18Dec2017a", set=exact, free=["f"], nuisance="none", anchor=False, starts=1,
        ...                intervals=False, processes=0)
        >>> round(found.values["f"])
        95
    """
    if not 0.5 <= level < 1.0:
        raise UserError(f"--level is {level:g}; allowed is 0.5 up to below 1")
    for what, given, allowed in (("window", window, ("paper", "whole")), ("split", split, (None, "paper"))):
        if given not in allowed:
            raise UserError(f"{what} is '{given}'; allowed is {' or '.join(str(a) for a in allowed)}")
    work = work_of(processes, scheduler, journal, progress)
    lines = Lines(tell)
    start = fibre_of(fibre, model, method, set, lines, for_fit=True)
    paths, in_memory = paths_and_trials(trials)
    if not (paths or in_memory) and features is None:
        raise UserError("nothing to fit to; give bags of trials, or --features")
    if not (paths or in_memory) and features_of is None:
        raise UserError("without bags nobody knows whose features to fit; give --features-of")
    known = known_of(reference_length, f0)
    found_trials = read(trials, start, known, trials_of, lines) if paths or in_memory else []
    fibres = dict.fromkeys(trial.facts.fibre for trial in found_trials)
    if len(fibres) > 1:
        raise UserError(f"trials are of fibres {', '.join(fibres)}; fit one fibre at a time")

    ties = dict(tie or {})
    begin, notes = starting_fibre(start, found_trials, free, fix, ties, set or {}, features_of)
    out = held_out([t.facts for t in found_trials], hold_out, train, split)
    if split and not any(out):
        notes.append(f"--split {split} holds none of the trials out: all of them are fitted")
    prepared = fit_trials(found_trials, out, window == "whole", weight or {})
    training = [t for t in prepared if not t.held_out and t.weight > 0.0]
    names, sds, unseen = nuisances_of([nuisance] if isinstance(nuisance, str) else nuisance, training)
    notes += unseen
    choices = choices_of(bound or {}, prior or {})
    if prior_fibers:
        choices, told = with_population(begin, choices, prior_fibers, free, fix, ties)
        notes += told
    coordinates = parameter_coordinates(begin, free, fix, ties, choices)
    coordinates += fault_coordinates(names, [t.name for t in training], [t.solution for t in training], sds)
    to_meet: tuple[Feature, ...] = (F0_ANCHOR,) if anchor else ()
    if features is not None:
        to_meet += measured(Path(features), features_of or begin.name, not force_pca_only, notes.append)
    problem = Problem(begin, prepared, coordinates, ties, to_meet)
    notes = [*start_lines(begin), *notes]
    lines.say(*notes)

    fitted = fitted_to(problem, Settings(starts, seed, level if intervals else None), work)
    provenance = {
        "bags": [str(path) for path in paths] or [trial.facts.trial for trial in in_memory],
        "fibre_of_trials": problem.fibre.name,
        "features": None if features is None else str(features),
        "start": fibre.name if isinstance(fibre, Fibre) else str(fibre),
        "split": {"hold_out": list(hold_out), "train": list(train), "preset": split},
        "json": "",
    }
    found = as_json(fitted, provenance, notes)
    lines.say(*found["warnings"])
    source = f"fitted with xb_muscle_ros.fit to {len(training)} trials; started from {provenance['start']}"
    values = replace(problem.fibre_at(fitted.best.z), path=None, source=source)
    return FitResult(values, found, table(found), tuple(lines), fitted)
