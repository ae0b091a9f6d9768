"""Trials made by a model: the paper's protocol, or any length and calcium."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.api.inputs import FibreLike, fibre_of
from xb_muscle_ros.api.making import completed, normalised
from xb_muscle_ros.api.tables import dataframe, drawn
from xb_muscle_ros.api.telling import Lines, Tell
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import refuse_older
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.protocols.base import run_of, settings_of
from xb_muscle_ros.protocols.running import answers, with_force
from xb_muscle_ros.protocols.stretch_shorten_stretch import StretchShortenStretches
from xb_muscle_ros.simulation.offline import one_for_all, pushing, simulate_trial
from xb_muscle_ros.trials.bag_files import plain
from xb_muscle_ros.trials.bag_writing import write_trial
from xb_muscle_ros.trials.protocol import ALLOWED
from xb_muscle_ros.trials.simulated import Simulated
from xb_muscle_ros.trials.trial import Trial

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

Numbers = float | Sequence[float]


@dataclass(frozen=True, repr=False, eq=False)
class SimulationResult:
    """Trials that a model made; `replay`, `fit`, `diagnose` and `evaluate` take it as it is.

    Attributes:
        fibre: parameters used.
        trials: length (m), calcium (µM) and force (N), arrays of shape (n,); in normalised units: 1 m is L0, 1 N is F0.
            A trial's force counts as measured where that was asked for (`as_measured`).
        simulated: for each trial force (N), length (m) and velocity (m/s) of the contractile element and moments,
            arrays of shape (n,).
        warnings: lines on what was taken for granted.
    """

    fibre: Fibre
    trials: tuple[Trial, ...]
    simulated: tuple[Simulated, ...]
    warnings: tuple[str, ...] = ()

    def __repr__(self) -> str:
        named = ", ".join(trial.facts.trial for trial in self.trials[:3]) + (", …" if len(self.trials) > 3 else "")
        return f"SimulationResult({self.fibre.name}, {self.fibre.model}, {len(self.trials)} trials: {named})"

    def to_dataframe(self) -> pd.DataFrame:
        """All samples, a row each.

        Columns: ``trial``, ``time_s``, ``length_change_l0``, ``calcium_um``, ``force_f0``, ``ce_length_change_l0``,
        ``ce_velocity_l0_per_s`` and the moments ``q0``, ``q1``, ``q2``, ``n_on``, ``drx``, ``r``.

        Raises:
            UserError: pandas is not there.
        """
        return samples(self.trials, self.simulated)

    def plot(self) -> Figure:
        """Length and force of the trials against time, nine at most.

        Returns:
            a Matplotlib figure.
        """
        # The model's force once, not once more as what was measured.
        bare = [replace(trial, force_time_s=np.empty(0), force_n=np.empty(0)) for trial in self.trials]
        return figure_of(bare, self.simulated, self.fibre.model)

    def save(self, folder: str | Path, *, prefix: str = "simulated", overwrite: bool = False) -> tuple[Path, ...]:
        """Write a bag for each trial, as ``xb_muscle simulate`` does.

        Args:
            folder: for the bags.
            prefix: begins their names.
            overwrite: replace bags of these names.

        Raises:
            UserError: a bag is there already, or cannot be written.
        """
        paths = [bag_path(Path(folder), prefix, trial) for trial in self.trials]
        refuse_older([path for path in paths if path.exists()], overwrite)
        for path, trial, simulated in zip(paths, self.trials, self.simulated, strict=True):
            write_trial(path, trial, simulated)
        return tuple(paths)


def simulate(
    fibre: FibreLike,
    *,
    model: str | None = None,
    method: str | None = None,
    set: Mapping[str, float] | None = None,
    pca: Numbers = 6.1,
    amplitude: Numbers = 0.0383,
    recovery: Numbers = 0.001,
    rate: float = 1000.0,
    settle: float | None = None,
    as_measured: bool = False,
    time: npt.ArrayLike | None = None,
    length: npt.ArrayLike | None = None,
    calcium: npt.ArrayLike | None = None,
    name: str = "arrays",
    tell: Tell | None = None,
) -> SimulationResult:
    """Simulate stretch-shorten-stretch trials, or a trial of any length and calcium.

    Without arrays every combination of `pca`, `amplitude` and `recovery` is a trial, as for ``xb_muscle simulate``.
    With `time`, `length` and `calcium` there is one trial of these samples, in the steps that the node takes.

    Args:
        fibre: name, fibre file or `Fibre`.
        model: see `replay`.
        method: see `replay`.
        set: see `replay`.
        pca: of the bathing solution, one or several.
        amplitude: of the conditioning stretch, L0, one or several; 0: none.
        recovery: time before the test stretch, s, one or several.
        rate: samples per second.
        settle: isometric time before the trial, s; None: until at rest.
        as_measured: the force counts as measured.
        time: shape (n,), strictly increasing from 0 on, s.
        length: shape (n,), length change relative to rest, L0; linear between samples.
        calcium: free calcium, µM; a number, or shape (n,): each value holds until the next.
        name: of the trial made from arrays.
        tell: hears each line on what was taken for granted; None: a `DataWarning` each.

    Returns:
        the trials with what the model answered, arrays of shape (n,) each.

    Raises:
        UserError: a number out of range, arrays that do not belong together, an unknown fibre, model or parameter.
        StateViolation: a state left its bounds; names fibre, state and time.

    Source:
        protocol and models of van der Zee et al. 2026, data of Horslen et al. 2023.

    Examples:
        >>> import numpy as np, xb_muscle_ros as xb
        >>> xb.simulate("18Dec2017a", pca=[4.5, 6.1], recovery=0.1)
        SimulationResult(18Dec2017a, 3state_coop, 2 trials: amp383_rt100ms_pca45, amp383_rt100ms_pca61)
        >>> t = np.arange(0.0, 0.2, 1e-3)
        >>> made = xb.simulate("18Dec2017a", time=t, length=0.01 * (t > 0.1), calcium=0.8)
        >>> made.simulated[0].force_n.shape
        (200,)
    """
    if settle is not None:
        ALLOWED["settle_s"].check("--settle", settle)
    lines = Lines(tell)
    chosen = fibre_of(fibre, model, method, set, lines)
    if not (time is None and length is None and calcium is None):
        if time is None or length is None or calcium is None:
            raise UserError("time, length and calcium belong together; give all three, or none for the protocol")
        trial, _ = completed(normalised(chosen.name, name, time, length, calcium))
        runs = iter([with_force(run_of(trial, simulate_trial(Muscle(chosen), trial, 1, settle)), chosen, as_measured)])
    else:
        protocol = StretchShortenStretches()
        settings = settings_of(protocol, {"pca": pca, "amplitude": amplitude, "recovery": recovery, "rate": rate})
        runs = answers(protocol, chosen, protocol.plan(chosen.name, settings), settle, as_measured)
    found = [(run.trial, run.simulated) for run in runs if run.simulated is not None]
    lines.say(*one_for_all([line for line in (pushing(t, s, chosen.model) for t, s in found) if line]))
    return SimulationResult(chosen, tuple(t for t, _ in found), tuple(s for _, s in found), tuple(lines))


def bag_path(folder: Path, prefix: str, trial: Trial) -> Path:
    """The bag of a simulated trial."""
    return folder / f"{prefix}_{trial.facts.fibre}_{plain(trial.facts.trial)}"


def samples(trials: Sequence[Trial], simulated: Sequence[Simulated]) -> pd.DataFrame:
    """All samples of simulated trials, see `SimulationResult.to_dataframe`."""
    rows: list[dict[str, Any]] = []
    for trial, answer in zip(trials, simulated, strict=True):
        l0, f0 = trial.facts.reference_length_m, trial.facts.f0_n
        held = np.searchsorted(trial.calcium_time_s, answer.time_s, side="right") - 1
        rows.append(
            {
                "trial": np.full(answer.time_s.size, trial.facts.trial, dtype=object),
                "time_s": answer.time_s,
                "length_change_l0": np.interp(answer.time_s, trial.time_s, trial.length_change_l0),
                "calcium_um": trial.calcium_um[np.maximum(held, 0)],
                "force_f0": answer.force_n / f0,
                "ce_length_change_l0": answer.ce_length_m / l0 - 1.0,
                "ce_velocity_l0_per_s": answer.ce_velocity_m_per_s / l0,
                **answer.moments,
            }
        )
    return dataframe({key: np.concatenate([row[key] for row in rows]) for key in rows[0]} if rows else {})


def figure_of(trials: Sequence[Trial], simulated: Sequence[Simulated], model: str) -> Figure:
    """The first page of length and force."""
    from xb_muscle_ros.models.titles import title_of
    from xb_muscle_ros.replay.figure import draw_replay

    return drawn(lambda: draw_replay(Path("replay.png"), trials, simulated, title_of(model)))
