"""Recordings through a model, offline or through a running node."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from xb_muscle_ros.api.inputs import FibreLike, TrialsLike, fibre_of, known_of
from xb_muscle_ros.api.inputs import trials_of as read
from xb_muscle_ros.api.simulating import figure_of, samples
from xb_muscle_ros.api.tables import dataframe, flat
from xb_muscle_ros.api.telling import Lines, Tell
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre, load_fibre
from xb_muscle_ros.replay.run import Player, Replay, check_room, write_results
from xb_muscle_ros.replay.run import replay as replayed
from xb_muscle_ros.simulation.offline import one_for_all, pushing
from xb_muscle_ros.trials.trial import Trial

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False, eq=False)
class ReplayResult(Replay):
    """Trials and what the model answered, in the order of the trials.

    Attributes:
        fibre: parameters used.
        live: whether a running node made the forces.
        simulated: for each trial force (N), length (m) and velocity (m/s) of the contractile element and moments,
            arrays of shape (n,).
        records: for each trial force RMSD (F0), SRS (F0/L0), isometric force (F0), with standard errors; see `rows`.
        table: the same as text.
        trials: as replayed.
        warnings: lines on what was taken for granted.
    """

    trials: tuple[Trial, ...] = ()
    warnings: tuple[str, ...] = ()

    def __repr__(self) -> str:
        known = [row["rmsd_f0"]["whole"] for row in self.rows if row["rmsd_f0"]["whole"] is not None]
        error = f", RMSD {100.0 * min(known):.2f} to {100.0 * max(known):.2f} % F0" if known else ""
        return f"ReplayResult({self.fibre.name}, {self.fibre.model}, {len(self.trials)} trials{error})"

    @property
    def rows(self) -> tuple[dict[str, Any], ...]:
        """The records as ``replay.json`` holds them, a mapping for each trial."""
        return tuple(record.as_row() for record in self.records)

    def to_dataframe(self, samples_of_trials: bool = False) -> pd.DataFrame:
        """A row for each trial; columns as the keys of ``replay.json``.

        Args:
            samples_of_trials: all samples in their place, as `SimulationResult.to_dataframe` has them.

        Raises:
            UserError: pandas is not there.
        """
        if samples_of_trials:
            return samples(self.trials, self.simulated)
        return dataframe(flat(row) for row in self.rows)

    def plot(self) -> Figure:
        """Length, measured force and the model's force against time, nine trials at most.

        Returns:
            a Matplotlib figure.
        """
        return figure_of(self.trials, self.simulated, self.fibre.model)

    def save(self, folder: str | Path, *, overwrite: bool = False) -> tuple[Path, ...]:
        """Write ``replay.json``, figures and a simulated bag per trial, as ``xb_muscle replay`` does.

        Args:
            folder: made if need be.
            overwrite: replace the results of an older replay.

        Returns:
            table and figures.

        Raises:
            UserError: an older replay is there, or the folder cannot be written.
        """
        check_room(Path(folder), self.trials, overwrite)
        return tuple(write_results(Path(folder), self.trials, self))


def replay(
    trials: TrialsLike,
    fibre: FibreLike,
    *,
    model: str | None = None,
    method: str | None = None,
    set: Mapping[str, float] | None = None,
    reference_length: str | float | None = None,
    f0: str | float | None = None,
    trials_of: str | None = None,
    substeps: int = 1,
    settle: float | None = None,
    live: bool = False,
    tell: Tell | None = None,
) -> ReplayResult:
    """Replay trials through a model and compare forces.

    Args:
        trials: bags, folders of bags, `Trial` objects, or what `simulate` returned.
        fibre: name, fibre file or `Fibre`.
        model: parameter set of the fibre file; None: the file's default.
        method: how heads are distributed over strain; None: the file's.
        set: other values of parameters, by name.
        reference_length: see `read_trials`; of bags only.
        f0: see `read_trials`; of bags only.
        trials_of: see `read_trials`; of bags only.
        substeps: steps between two samples; 1 is what the node does.
        settle: isometric time before each trial, s; None: until at rest.
        live: play the trials through a running ``muscle_node`` in lockstep.
        tell: hears each line on what was taken for granted; None: a `DataWarning` each.

    Returns:
        forces and their errors, a record for each trial; arrays of shape (n,), in N, m and s.

    Raises:
        UserError: see `read_trials` and `load_fibre`; an option out of range; no node.
        StateViolation: a state left its bounds; names trial, fibre, state and time.

    Source:
        windows and scores of van der Zee et al. 2026, see docs/evaluate.md.

    Examples:
        >>> import xb_muscle_ros as xb
        >>> made = xb.simulate("18Dec2017a", recovery=0.1)
        >>> found = xb.replay(made, "18Dec2017a")
        >>> found.rows[0]["rmsd_f0"]["whole"] < 1e-4
        True
    """
    check_options(substeps, settle, live, bool(set))
    lines = Lines(tell)
    chosen = fibre_of(fibre, model, method, set, lines)
    check_options(live=live, changed=live and not _as_in_its_file(chosen))
    found = read(trials, chosen, known_of(reference_length, f0), trials_of, lines)
    others = [trial.facts.fibre for trial in found if trial.facts.fibre != chosen.name]
    if others:
        whose = ", ".join(dict.fromkeys(others))
        lines.say(
            f"{len(others)} of {len(found)} trials are of fibre {whose}, replayed with parameters of {chosen.name}"
        )
    player: Player | None = None
    if live:
        # The one place where this function touches ROS, and only when asked to.
        from xb_muscle_ros.node.client.live import play_live

        player = play_live
    results = replayed(found, chosen, player, substeps, settle)
    told = [pushing(*pair, chosen.model) for pair in zip(found, results.simulated, strict=True)]
    lines.say(*one_for_all([line for line in told if line]))
    return ReplayResult(**vars(results), trials=tuple(found), warnings=tuple(lines))


def check_options(substeps: int = 1, settle: float | None = None, live: bool = False, changed: bool = False) -> None:
    """Check options that do not go with everything.

    Args:
        substeps: see `replay`.
        settle: see `replay`.
        live: see `replay`.
        changed: whether the fibre has other values than its file.

    Raises:
        UserError: one is out of range, or two are against each other.
    """
    if not 1 <= substeps <= 10000:
        raise UserError(f"--substeps is {substeps}; allowed is 1 to 10000")
    if settle is not None and not 0.0 < settle <= 1e6:
        raise UserError(f"--settle is {settle:g} s; allowed is above 0 to 1e6")
    if live and (substeps != 1 or settle is not None):
        raise UserError("--live leaves steps and settling to the node; drop --substeps and --settle")
    if live and changed:
        raise UserError("--live gives the node a fibre file as it is; put the values of --set into a file of your own")


def _as_in_its_file(fibre: Fibre) -> bool:
    return fibre.path is not None and load_fibre(fibre.path, fibre.model, fibre.method).values == fibre.values
