"""What a model leaves of the recordings: where it stands out, in which cells, and which law describes it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Place:
    """Where a residual stands out.

    Attributes:
        fibre, trial, phase: where; times of the trial, s.
        pca: of the solution; None where it changes.
        size_f0: root mean square of measured less simulated force, F0.
        mean_f0: its mean, F0: above 0 where the fibre pulls harder than the model.
        p_value: family-wise.
    """

    fibre: str
    trial: str
    phase: str
    start_s: float
    end_s: float
    size_f0: float
    mean_f0: float
    p_value: float
    pca: float | None = None


@dataclass(frozen=True)
class ResidualLaw:
    """A Prony series in the length change that describes a residual and does not explain it.

    Attributes:
        time_constant_s: the dominant one.
        scales_with: ``constant``, ``activation``, ``calcium`` or ``force``.
        gain_f0_per_l0: of all exponentials together: force per length of a sudden change where what it scales with is
            1; below 0 where the model lacks force against the sign of velocity.
        explained_fraction: of the residual's mean square in trials left out; of one trial, of itself.
        tau_s: time constants that were offered, s.
        weight_f0: root-mean-square force of each in the recordings before any refit, F0, with the sign of the gain.
        other_scalings: explained fraction for what else it could scale with.
    """

    fibre: str
    time_constant_s: float
    scales_with: str
    gain_f0_per_l0: float
    explained_fraction: float
    tau_s: tuple[float, ...] = ()
    weight_f0: tuple[float, ...] = ()
    other_scalings: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class AnswerResidual:
    """What the answer leaves.

    Attributes:
        rmsd_f0: of all trials, F0.
        noise_f0: of the recordings, F0.
        places: the largest first; empty where nothing stands out.
        law: None where none holds.
    """

    rmsd_f0: float
    noise_f0: float
    places: tuple[Place, ...]
    law: ResidualLaw | None


@dataclass(frozen=True)
class ResidualMap:
    """The residual of one fibre by trial (rows) and phase (columns); None where a trial lacks a phase.

    Attributes:
        trials, phases: names of rows and columns.
        rms_f0, mean_f0: root mean square and mean of measured less simulated force, F0.
        p_value: family-wise.
        counts: whether the cell stands out and is large enough to matter.
    """

    trials: tuple[str, ...] = ()
    phases: tuple[str, ...] = ()
    rms_f0: tuple[tuple[float | None, ...], ...] = ()
    mean_f0: tuple[tuple[float | None, ...], ...] = ()
    p_value: tuple[tuple[float | None, ...], ...] = ()
    counts: tuple[tuple[bool, ...], ...] = ()

    def cells(self) -> Iterator[tuple[str, str, float, float | None, bool]]:
        """Trial, phase, root mean square, mean and whether it counts, of every cell that there is."""
        for trial, *rows in zip(self.trials, self.rms_f0, self.mean_f0, self.counts, strict=True):
            for phase, rms, mean, counts in zip(self.phases, *rows, strict=True):
                if rms is not None:
                    yield trial, phase, rms, mean, counts
