"""Trials as tables in files: CSV, Parquet, OpenSim's storage."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from xb_muscle_ros.api.inputs import TrialsLike, paths_and_trials
from xb_muscle_ros.api.telling import Lines, Tell
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import refuse_older
from xb_muscle_ros.trials.bag_files import find_bags, plain
from xb_muscle_ros.trials.bag_reading import TrialBag, read_simulated
from xb_muscle_ros.trials.completing import Known, complete
from xb_muscle_ros.trials.readers.description import name_of
from xb_muscle_ros.trials.simulated import Simulated
from xb_muscle_ros.trials.study import alike
from xb_muscle_ros.trials.table_writing import WRITERS, write_mapping
from xb_muscle_ros.trials.tabulating import TrialTable, tables_of
from xb_muscle_ros.trials.trial import Trial

if TYPE_CHECKING:
    from xb_muscle_ros.api.replaying import ReplayResult

CSV = "csv"


class _Named(NamedTuple):
    """A trial under the name of its files."""

    name: str
    trial: Trial
    simulated: Simulated | None


def export_trials(
    trials: TrialsLike | ReplayResult,
    folder: str | Path,
    *,
    to: str = CSV,
    interpolate: bool = False,
    overwrite: bool = False,
    tell: Tell | None = None,
) -> tuple[Path, ...]:
    """Write each trial as a table, simulated and measured side by side.

    Columns: ``time_s``, ``length_m``, ``length_change_l0``, ``calcium_um``, and where they are there
    ``force_measured_n``, ``force_measured_f0``, ``force_simulated_n``, ``force_simulated_f0``, ``ce_length_m``,
    ``ce_length_l0``, ``ce_velocity_m_per_s`` and the moments ``q0``, ``q1``, ``q2``, ``n_on``, ``drx``, ``r``. A force
    whose clock is not that of the lengths has a table of its own.

    Args:
        trials: bags, folders of bags, `Trial` objects, or what `simulate` and `replay` returned.
        folder: for the files; made if need be.
        to: ``csv``, with a mapping beside it by which ``xb_muscle import`` makes the trial again; ``parquet``; or
            ``sto``, OpenSim's storage format.
        interpolate: put forces of another clock on that of the lengths, by straight lines, and say so.
        overwrite: replace files of these names.
        tell: hears each line on what was taken for granted; None: a `DataWarning` each.

    Returns:
        what was written.

    Raises:
        UserError: an unknown format, a bag that cannot be read, two trials of one name, or files that exist; nothing is
            written then.

    Source:
        storage files: OpenSim's documentation of .sto files.

    Examples:
        >>> import tempfile, xb_muscle_ros as xb
        >>> made = xb.simulate("18Dec2017a", recovery=0.1)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in xb.export_trials(made, folder, to="sto")]
        ['amp383_rt100ms_pca61.sto']
    """
    if to not in WRITERS:
        raise UserError(f"--to is '{to}'; allowed: {', '.join(WRITERS)}")
    lines = Lines(tell)
    found = _found(trials, lines)
    if not found:
        raise UserError("there is no trial to export; give bags, or trials in memory")
    names = [each.name for each in found]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise UserError(f"{names.count(twice)} trials would become {twice}.{to}; export them into folders of their own")
    planned: list[tuple[Path, Trial, TrialTable]] = []
    for each in found:
        for table in tables_of(each.trial, each.simulated, interpolate):
            file = f"{each.name}_{table.name}" if table.name else each.name
            planned.append((Path(folder) / f"{file}.{to}", each.trial, table))
            lines.say(*(f"{each.name}: {note}" for note in table.notes))
    mappings = {path: path.with_suffix(".yaml") for path, _, table in planned if to == CSV and not table.name}
    paths = [path for path, _, _ in planned]
    clash = next((path for path in paths if paths.count(path) > 1), None)
    if clash is not None:
        raise UserError(f"two tables would become {clash}; export their bags into folders of their own")
    refuse_older([path for path in (*paths, *mappings.values()) if path.exists()], overwrite)
    for path, trial, table in planned:
        WRITERS[to](path, table)
        if path in mappings:
            write_mapping(mappings[path], trial, table)
    return tuple(each for path in paths for each in (path, mappings.get(path)) if each is not None)


def _found(trials: TrialsLike | ReplayResult, lines: Lines) -> list[_Named]:
    """Trials with what a model answered to each, all of them read."""
    simulated: Sequence[Simulated | None] = getattr(trials, "simulated", ())
    paths, in_memory = paths_and_trials(trials)  # type: ignore[arg-type]  # results of replay have trials as well
    if in_memory:
        answers = list(simulated) or [None] * len(in_memory)
        return [
            _Named(_plain(trial.facts.trial), trial, answer) for trial, answer in zip(in_memory, answers, strict=True)
        ]
    found: list[_Named] = []
    told: list[str] = []
    for path in find_bags(paths):
        bag = TrialBag(path)
        alone = len(bag.fibres) == 1
        for fibre in bag.fibres:
            trial, notes = complete(bag.reading(fibre), Known())
            answer = _simulated(path) if alone else None
            found.append(_Named(_plain(name_of(path) if alone else f"{name_of(path)}_{fibre}"), trial, answer))
            told += [f"bag {path}: {line}" for line in notes]
            told += [line for line in trial.warnings if answer is None or "compared with the recorded" not in line]
        if not alone:
            told.append(f"bag {path}: it is of several fibres, so their moments and elements are not exported")
    lines.say(*alike(told))
    return found


def _simulated(path: Path) -> Simulated | None:
    """What a model answered; None without its topics: a force without moments is told where the trial is read."""
    try:
        return read_simulated(path)
    except UserError:
        return None


def _plain(name: str) -> str:
    return plain(name).lstrip(".-") or "_"
