"""Protocols of a muscle laboratory: through a model, and read off recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from xb_muscle_ros.api.inputs import (
    FibreLike,
    TrialsLike,
    fibre_of,
    kept,
    known_of,
    paths_and_trials,
    picked,
    read_trials,
)
from xb_muscle_ros.api.protocol_runs import answers
from xb_muscle_ros.api.simulating import bag_path
from xb_muscle_ros.api.tables import dataframe, drawn
from xb_muscle_ros.api.telling import Lines, Tell
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.evaluate.sets import file_serving, served_line
from xb_muscle_ros.files import plain_tree, refuse_older
from xb_muscle_ros.models.fibre_file import Fibre, find_fibre_file, load_fibre
from xb_muscle_ros.protocols import report, running
from xb_muscle_ros.protocols.base import Found, Protocol, Run, settings_of
from xb_muscle_ros.protocols.registry import protocol_of
from xb_muscle_ros.simulation.offline import one_for_all, pushing
from xb_muscle_ros.trials.bag_files import remove_results
from xb_muscle_ros.trials.bag_writing import write_trial
from xb_muscle_ros.trials.protocol import ALLOWED
from xb_muscle_ros.trials.simulated import Simulated
from xb_muscle_ros.trials.trial import Trial

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

Numbers = float | Sequence[float] | None


@dataclass(frozen=True, repr=False, eq=False)
class ProtocolResult:
    """What a protocol showed.

    Attributes:
        protocol: its name.
        results: what was found of each fibre, measured and by each model: table, numbers, curves, notes.
        warnings: lines on what is missing or was taken for granted.
        made: whether the protocol made the trials, so that `save` writes a bag of each.
    """

    protocol: str
    results: tuple[Found, ...]
    warnings: tuple[str, ...] = ()
    made: bool = True

    def __repr__(self) -> str:
        of = ", ".join(f"{each.fibre}: {each.of}" for each in self.results[:3])
        return f"ProtocolResult({self.protocol}; {of}{', …' if len(self.results) > 3 else ''})"

    def __str__(self) -> str:
        """The tables that ``xb_muscle simulate --protocol`` prints."""
        protocol = protocol_of(self.protocol)
        if numbers := report.numbers_table(protocol, self.results):
            return numbers
        return "\n\n".join(f"{each.fibre}, {each.of}\n\n{report.rows_table(protocol, each)}" for each in self.results)

    @property
    def found(self) -> Mapping[str, Any]:
        """What the JSON file holds."""
        tree: Mapping[str, Any] = plain_tree(report.tree(protocol_of(self.protocol), self.results))
        return tree

    @property
    def trials(self) -> tuple[Trial, ...]:
        """Trials of all results, those of a model with its force; length in m, force in N, arrays of shape (n,)."""
        return tuple(run.trial for each in self.results for run in each.runs)

    @property
    def simulated(self) -> tuple[Simulated | None, ...]:
        """For each trial the model's force and moments; None for a recording."""
        return tuple(run.simulated for each in self.results for run in each.runs)

    def to_dataframe(self) -> pd.DataFrame:
        """The table: a row for each trial or level, with ``fibre`` and ``of``; standard errors end with ``_se``.

        Raises:
            UserError: pandas is not there.
        """
        return dataframe(report.rows(protocol_of(self.protocol), self.results))

    def plot(self, which: str | None = None) -> Figure:
        """The figure of one fibre.

        Args:
            which: name of the file it would be, without suffix; None: the first.

        Returns:
            a Matplotlib figure.
        """
        return drawn(lambda: report.draw(Path(), protocol_of(self.protocol), self.results), which)

    def save(self, folder: str | Path, *, prefix: str = "simulated", overwrite: bool = False) -> tuple[Path, ...]:
        """Write table, numbers and figure, and a bag of each trial that a model made up.

        Args:
            folder: made if need be.
            prefix: begins the names of bags.
            overwrite: replace results of an older run.

        Returns:
            files and bags.

        Raises:
            UserError: results of an older run are there, or the folder cannot be written.
        """
        folder, protocol = Path(folder), protocol_of(self.protocol)
        runs = [run for each in self.results for run in each.runs] if self.made else []
        bags = [(bag_path(folder, prefix, run.trial), run) for run in runs]
        check_room(folder, protocol, [path for path, _ in bags], overwrite)
        remove_results(report.older_results(folder, protocol))
        written = report.write(folder, protocol, self.results)
        for path, run in bags:
            write_trial(path, run.trial, run.simulated)
        return (*written, *(path for path, _ in bags))


def run_protocol(
    protocol: str,
    fibre: FibreLike,
    *,
    model: str | None = None,
    method: str | None = None,
    set: Mapping[str, float] | None = None,
    settle: float | None = None,
    as_measured: bool = False,
    tell: Tell | None = None,
    each: Callable[[Run], None] | None = None,
    live: bool = False,
    **options: Numbers,
) -> ProtocolResult:
    """Run a protocol of a muscle laboratory through a model, and read off what a physiologist would.

    Args:
        protocol: name, for example ``force-pca``; docs/protocols.md has all.
        fibre: name, fibre file or `Fibre`.
        model: see `replay`.
        method: see `replay`.
        set: see `replay`.
        settle: isometric time before each trial, s; None: until at rest.
        as_measured: the force counts as measured.
        tell: hears each line on what is missing or was taken for granted; None: a `DataWarning` each.
        each: hears each trial as soon as it is made.
        live: play the trials through a running ``muscle_node`` in lockstep, sample by sample; for ``force-clamp`` with
            ``control`` set to ``force``.
        options: of the protocol, a number or several, for example ``pca=[4.5, 6.1]``.

    Returns:
        table, numbers with errors and the trials; forces in F0, lengths in L0.

    Raises:
        UserError: an unknown protocol, option, fibre, model or parameter, or a number out of range.
        StateViolation: a state left its bounds; names fibre, state and time.

    Source:
        docs/protocols.md, with a reference for each.

    Examples:
        >>> import xb_muscle_ros as xb
        >>> found = xb.run_protocol("force-pca", "18Dec2017a", pca=[4.5, 5.5, 6.0, 6.2, 6.4, 7.0])
        >>> round(found.results[0].numbers["pca50"].value, 1)
        6.1
    """
    chosen = protocol_of(protocol)
    settings = settings_of(chosen, options)
    if settle is not None:
        ALLOWED["settle_s"].check("--settle", settle)
    lines = Lines(tell)
    whose = fibre_of(fibre, model, method, set, lines)
    runs = []
    planned = chosen.plan(whose.name, settings)
    lacking: list[str] = []
    for run in answers(chosen, whose, planned, settle, as_measured, live, lacking):
        runs.append(run)
        if each is not None:
            each(run)
    told = [pushing(run.trial, run.simulated, whose.model) for run in runs if run.simulated is not None]
    lines.say(*one_for_all([line for line in told if line]))
    found = running.analysed(chosen, whose.name, whose.model, runs, lacking)
    lines.say(*found.notes)
    return ProtocolResult(chosen.name, (found,), tuple(lines))


def analyse_protocol(
    protocol: str,
    trials: TrialsLike,
    *,
    fibre: FibreLike | Sequence[FibreLike] = (),
    model: str | Sequence[str] = (),
    method: str | None = None,
    reference_length: str | float | None = None,
    f0: str | float | None = None,
    trials_of: str | None = None,
    settle: float | None = None,
    tell: Tell | None = None,
) -> ProtocolResult:
    """Read a protocol's table and numbers off recordings, and off models that are given the same.

    Args:
        protocol: name; docs/protocols.md has all.
        trials: bags, folders of bags, `Trial` objects, or what `simulate` or `run_protocol` returned.
        fibre: names, fibre files or `Fibre` of the models, one or several; empty: the package's file of each trial's
            fibre.
        model: parameter sets, one or several; empty: the recordings alone.
        method: see `replay`.
        reference_length: see `read_trials`; of bags only.
        f0: see `read_trials`; of bags only.
        trials_of: see `read_trials`; of bags only.
        settle: isometric time before each trial, s; None: until at rest.
        tell: hears each line on what is missing or was taken for granted; None: a `DataWarning` each.

    Returns:
        for each fibre what was measured, then what each model shows.

    Raises:
        UserError: see `read_trials`; no trial has a measured force; an unknown protocol, fibre or model.
        StateViolation: a state left its bounds.

    Source:
        docs/protocols.md, with a reference for each.

    Examples:
        >>> import xb_muscle_ros as xb
        >>> made = xb.run_protocol("force-pca", "18Dec2017a", model="2state", as_measured=True)
        >>> xb.analyse_protocol("force-pca", made, model="3state_coop", tell=lambda line: None)
        ProtocolResult(force-pca; 18Dec2017a: measured, 18Dec2017a: 3state_coop)
    """
    chosen = protocol_of(protocol)
    if settle is not None:
        ALLOWED["settle_s"].check("--settle", settle)
    lines = Lines(tell)
    paths, found = paths_and_trials(trials)
    if paths:
        whose = fibre if isinstance(fibre, (str, Path, Fibre)) else next(iter(fibre), None)
        read = read_trials(paths, whose, tell=lines.say, reference_length=reference_length, f0=f0, trials_of=trials_of)
        found = list(read)
    else:
        found = kept(found, known_of(reference_length, f0), trials_of)
    models = (model,) if isinstance(model, str) else tuple(model)
    names = list(dict.fromkeys(trial.facts.fibre for trial in found))
    serving = _serving(fibre, names, lines) if models else {}
    results = []
    for name in names:
        mine = [trial for trial in found if trial.facts.fibre == name]
        measured = running.read_measured(chosen, name, mine)
        if not measured.runs:
            raise UserError(
                f"no trial of fibre {name} has a measured force; give recordings, or make trials with --as-measured"
            )
        results.append(measured)
        for each in models:
            results.append(running.read_model(chosen, picked(serving[name], each, method), mine, settle))
    for result in results:
        lines.say(*(f"{result.fibre}, {result.of}: {note}" for note in result.notes))
    return ProtocolResult(chosen.name, tuple(results), tuple(lines), made=False)


def check_room(folder: Path, protocol: Protocol | None, bags: Sequence[Path], overwrite: bool) -> None:
    """Make sure that bags, and results of a protocol unless it is None, may be written to a folder.

    Raises:
        UserError: results of an older run are there and may not be replaced.
    """
    older = [] if protocol is None else report.older_results(folder, protocol)
    refuse_older([*older, *(path for path in bags if path.exists())], overwrite)


def _serving(given: FibreLike | Sequence[FibreLike], names: Sequence[str], lines: Lines) -> dict[str, FibreLike]:
    """The fibre or fibre file whose sets stand for each recorded fibre; one for all is said.

    Raises:
        UserError: a fibre has none.
    """
    each = (given,) if isinstance(given, (str, Path, Fibre)) else tuple(given)
    if len(each) == 1 and isinstance(each[0], Fibre):
        return dict.fromkeys(names, each[0])
    files = {find_fibre_file(file) for file in each if not isinstance(file, Fibre)}
    held: Mapping[str, str | Path] | None = {load_fibre(file).name: file for file in files} if files else None
    lines.say(served_line(held, names))
    own = {fibre.name: fibre for fibre in each if isinstance(fibre, Fibre)}
    return {name: own[name] if name in own else file_serving(held, name) for name in names}
