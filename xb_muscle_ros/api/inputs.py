"""Arguments turned into fibres and trials: from names, paths or objects in memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, Union

from xb_muscle_ros.api.telling import Lines, Tell
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import refuse_older
from xb_muscle_ros.models.catalogue import without_effect_line
from xb_muscle_ros.models.fibre_file import Fibre, borrowed_line, changed, load_fibre
from xb_muscle_ros.models.passive import passive_twice_line
from xb_muscle_ros.models.strain_bins import wide_bins_line
from xb_muscle_ros.trials.bag_files import plain
from xb_muscle_ros.trials.bag_writing import write_trial
from xb_muscle_ros.trials.completing import Known
from xb_muscle_ros.trials.readers.description import FIRST_ISOMETRIC
from xb_muscle_ros.trials.readers.units import quantity
from xb_muscle_ros.trials.study import alike, read_study
from xb_muscle_ros.trials.trial import Trial
from xb_muscle_ros.work import Options

if TYPE_CHECKING:
    from xb_muscle_ros.api.simulating import SimulationResult

FibreLike: TypeAlias = str | Path | Fibre
"""Name of a fibre in the package, path of a fibre file, or a fibre."""
PathOrTrial: TypeAlias = str | Path | Trial
TrialsLike: TypeAlias = Union[PathOrTrial, Sequence[PathOrTrial], "SimulationResult"]
"""Bags or folders of bags, trials in memory, or what `simulate` returned."""


def fibre_of(
    fibre: FibreLike,
    model: str | None,
    method: str | None,
    values: Mapping[str, float] | None,
    lines: Lines,
    for_fit: bool = False,
) -> Fibre:
    """The fibre that the arguments pick, with other values of parameters by name; what it lacks of its own is said.

    Raises:
        UserError: see `picked` and `changed`.
    """
    found = changed(picked(fibre, model, method, for_fit, values), dict(values or {}), "--set")
    lines.say(borrowed_line(found))
    if not for_fit:  # a fit says these of the values that it ends with
        lines.say(without_effect_line(found.model, found.values), wide_bins_line(found.values))
        lines.say(passive_twice_line(found.values))
    return found


def picked(
    fibre: FibreLike,
    model: str | None,
    method: str | None,
    for_fit: bool = False,
    values: Mapping[str, float] | None = None,
) -> Fibre:
    """A fibre in memory as it is, or that of a file; `values` where the file lacks parameters.

    Raises:
        UserError: see `load_fibre`; a fibre in memory is of another model or method.
    """
    if not isinstance(fibre, Fibre):
        return load_fibre(fibre, model, method, for_fit, values)
    for what, wanted in (("model", model), ("method", method)):
        if wanted not in (None, getattr(fibre, what)):
            raise UserError(
                f"fibre {fibre.name} is loaded with {what} {getattr(fibre, what)}, not '{wanted}'; give its name or "
                f"file in its place, or load it with that {what}"
            )
    return fibre


def known_of(reference_length: str | float | None, f0: str | float | None) -> Known:
    """What the user knows of L0 and F0.

    Args:
        reference_length: the length that is L0: text with a unit such as ``30 mm``, ``first_isometric``, or m.
        f0: the force that is F0: text with a unit such as ``0.5 mN``, or N.

    Raises:
        UserError: no length or no force.
    """

    def value(option: str, given: str | float | None, kind: str, example: str) -> float | None:
        if given is None:
            return None
        if not isinstance(given, str):
            if not 0.0 < given < float("inf"):
                raise UserError(f"{option} is {given:g}; allowed are numbers above 0, or text such as '{example}'")
            return float(given)
        found = quantity(given, kind, "value", option, example)
        if found.kind != kind:
            raise UserError(f"{option} is '{given}'; needed is a {kind}, for example '{example}'")
        return found.value

    first = reference_length == FIRST_ISOMETRIC
    return Known(
        None if first else value("--reference-length", reference_length, "length", "30 mm"),
        first,
        value("--f0", f0, "force", "0.5 mN"),
    )


def paths_and_trials(trials: TrialsLike) -> tuple[list[str | Path], list[Trial]]:
    """Paths, or trials in memory, whichever were given.

    Raises:
        UserError: nothing, both, or anything else.
    """
    given: Any = getattr(trials, "trials", trials)
    each = [given] if isinstance(given, (str, Path, Trial)) else list(given)
    paths = [item for item in each if isinstance(item, (str, Path))]
    in_memory = [item for item in each if isinstance(item, Trial)]
    strange = [type(item).__name__ for item in each if not isinstance(item, (str, Path, Trial))]
    if strange or (paths and in_memory):
        what = f"an object of type {strange[0]}" if strange else "bags and trials in memory together"
        raise UserError(f"trials are {what}; give bags, or trials in memory")
    return paths, in_memory


def trials_of(trials: TrialsLike, fibre: Fibre, known: Known, only: str | None, lines: Lines) -> list[Trial]:
    """Trials in memory, or those of the bags, complete and checked; see `read_study`.

    Raises:
        UserError: see `read_study`; options of bags with trials in memory.
    """
    paths, found = paths_and_trials(trials)
    if not found:
        study = read_study(paths, fibre.name, known.of_file(fibre), only)
        lines.say(*study.lines)
        return study.trials
    found = kept(found, known, only)
    lines.say(*alike(line for trial in found for line in trial.warnings))
    return found


def kept(trials: Sequence[Trial], known: Known, only: str | None) -> list[Trial]:
    """Trials in memory of the fibre that is asked for.

    Raises:
        UserError: none is of this fibre; L0 or F0 is given, which trials in memory have.
    """
    if known != Known():
        raise UserError("trials in memory have their own L0 and F0; leave reference_length and f0 out")
    found = [trial for trial in trials if only in (None, trial.facts.fibre)]
    if not found:
        raise UserError(f"no trial in memory is of fibre '{only}', which trials_of asks for")
    return found


def work_of(
    processes: int | None,
    scheduler: str | None,
    journal: str | Path | None,
    progress: bool = True,
    label: str = "",
) -> Options:
    """Where long work is done, see `work.Options`.

    Raises:
        UserError: options that are out of range or against each other.
    """
    if processes is not None and scheduler is not None:
        raise UserError("--processes is of this machine and --scheduler of a cluster; drop one of them")
    if processes is not None and not 0 <= processes <= 1024:
        raise UserError(f"--processes is {processes}; allowed is 0 to 1024")
    return Options(scheduler, processes, None if journal is None else Path(journal), label, not progress)


def read_trials(
    bags: str | Path | Sequence[str | Path],
    fibre: FibreLike | None = None,
    *,
    reference_length: str | float | None = None,
    f0: str | float | None = None,
    trials_of: str | None = None,
    tell: Tell | None = None,
) -> tuple[Trial, ...]:
    """Read trials from bags.

    What a bag does not tell (L0, F0, phases, pCa) is taken from the arguments, the fibre file or the samples, and said.

    Args:
        bags: bag folders, ``.mcap`` files or folders of bags.
        fibre: whose L0 (m) and F0 (N) stand in for those that a bag lacks; None: 1 m and 1 N, as for normalised data.
        reference_length: the length that is L0, before that of a bag: text such as ``'30 mm'``, a number in m, or
            ``'first_isometric'``.
        f0: the force that is F0, before that of a bag: text such as ``'0.5 mN'``, or a number in N.
        trials_of: of bags of several fibres, take the trials of this one.
        tell: hears each line on what was taken for granted; None: a `DataWarning` each.

    Returns:
        trials in the order of the bags; arrays of shape (n,) each, in s, m, µM and N (see `Trial`).

    Raises:
        UserError: a bag cannot be read, has no trial of the fibre, or has values that no muscle has.

    Source:
        layout of the bags: docs/bags.md.

    Examples:
        >>> import xb_muscle_ros as xb
        >>> notes = []
        >>> trials = xb.read_trials("bags", tell=notes.append)
        >>> [trial.facts.trial for trial in trials]
        ['amp0_rt1ms_pca61', 'amp383_rt1ms_pca61']
    """
    lines = Lines(tell)
    known = known_of(reference_length, f0)
    name = ""
    if fibre is not None:
        whose = fibre if isinstance(fibre, Fibre) else load_fibre(fibre)
        name, known = whose.name, known.of_file(whose)
    study = read_study([bags] if isinstance(bags, (str, Path)) else bags, name, known, trials_of)
    lines.say(*study.lines)
    return tuple(study.trials)


def write_trials(trials: Trial | Sequence[Trial], folder: str | Path, *, overwrite: bool = False) -> tuple[Path, ...]:
    """Write trials as ROS 2 bags (MCAP), one folder each, named after the trial.

    Args:
        trials: with at least one length and one calcium sample each; times in s, lengths in m, calcium in µM, force in
            N, each array of shape (n,).
        folder: for the bags; made if need be.
        overwrite: replace bags of these names.

    Returns:
        the bags, in order.

    Raises:
        UserError: a bag is there already, two trials have one name, or a trial cannot be a bag.

    Source:
        layout of the bags: docs/bags.md.

    Examples:
        >>> import tempfile, xb_muscle_ros as xb
        >>> trial = xb.StretchShortenStretch(amplitude_l0=0.0383, recovery_s=0.1).trial("mine", pca=6.1)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [bag.name for bag in xb.write_trials(trial, folder)]
        ['amp383_rt100ms_pca61']
    """
    each = [trials] if isinstance(trials, Trial) else list(trials)
    paths = [Path(folder) / (plain(trial.facts.trial).lstrip(".-") or "_") for trial in each]
    twice = next((path for path in paths if paths.count(path) > 1), None)
    if twice is not None:
        raise UserError(f"{paths.count(twice)} trials would become bag {twice}; give each trial a name of its own")
    refuse_older([path for path in paths if path.exists()], overwrite)
    for path, trial in zip(paths, each, strict=True):
        write_trial(path, trial)
    return tuple(paths)
