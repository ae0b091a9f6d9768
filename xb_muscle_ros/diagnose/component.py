"""What may be part of a mismatch: a mechanism or an artefact with its probability, as a diagnosis records it.

Units as in `result`.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

NAMED, SURE = 0.5, 0.9
"""Inclusion probability from which a mechanism is in the answer, and from which physics may be the verdict."""
REPLICATED = 1.0
"""Log Bayes factor of a fibre, given the others, from which it replicates a component: positive evidence (2.7 to 1)
on the scale of Kass and Raftery 1995."""


class Kind(str, enum.Enum):
    """What a component is."""

    MECHANISM = "mechanism"
    ARTEFACT = "artefact"
    """A measurement artefact beyond what is ordinary."""


@dataclass(frozen=True)
class HeldOutGain:
    """What a component, or the whole answer, gains on conditions that were left out of the fit.

    Attributes:
        mean: mean over the conditions of the logarithm of RMSD without over RMSD with it; above 0 where it predicts
            better.
        se: standard error of the mean over conditions.
        unit: of mean and se: ``log RMSD ratio``.
        conditions: how many were left out in turn.
        without_f0, with_f0: RMSD over all held-out samples, F0.
    """

    mean: float
    se: float
    unit: str
    conditions: int
    without_f0: float
    with_f0: float

    @property
    def beyond_error(self) -> bool:
        """Whether the gain exceeds its standard error."""
        return self.mean > self.se


@dataclass(frozen=True)
class Parameter:
    """A component's parameter.

    Attributes:
        name, unit: of the parameter table, or of the artefact, with its group in brackets.
        value: estimate, averaged over the sets that have the component; over fibres: the centre of their distribution.
        interval: 95 %, without the probability that the component is absent.
        spread: standard deviation over fibres, in its unit; None for one fibre.
    """

    name: str
    unit: str
    value: float
    interval: tuple[float, float]
    at_bound: bool = False
    spread: float | None = None


@dataclass(frozen=True)
class OfFibre:
    """A component in one fibre of a study.

    Attributes:
        inclusion_probability: from this fibre's recordings alone.
        heldout_gain: None where nothing could be left out.
        replication: log Bayes factor for the component by this fibre's recordings, given those of all other fibres;
            within ±50; None for a study of one fibre.
    """

    fibre: str
    inclusion_probability: float
    ablation_loss: float
    heldout_gain: HeldOutGain | None
    parameters: tuple[Parameter, ...]
    replication: float | None = None

    @property
    def replicates(self) -> bool:
        """Whether this fibre says again what the others say."""
        return self.replication is not None and self.replication >= REPLICATED


@dataclass(frozen=True)
class Component:
    """Something that may be part of what the model lacks, or of what the recordings have wrong.

    Attributes:
        name: of the mechanism or artefact, or of a family whose members are not separable.
        family: of `names.FAMILY`.
        members: names in it, the likeliest first; a single name: itself.
        inclusion_probability: that it, or one of its members, is part of the truth.
        ablation_loss: ablation loss as a share of the base's mismatch (0 where it is not part of the answer).
        heldout_gain: what is lost without it on held-out conditions; None where it was not tried.
        parameters: of the likeliest member.
        direction: what it does to the force, in plain words; empty where it is not part of the answer.
        not_separable_from: names of other components with which it trades probability.
        by_fibre: one row for each fibre, also where there is one.
        log_odds: of averaging over sets, before calibration; within ±50.
        contribution_f0: root of what it takes off the mean square of the best set without its family, F0.
    """

    name: str
    kind: Kind
    family: str
    members: tuple[str, ...]
    inclusion_probability: float
    ablation_loss: float = 0.0
    heldout_gain: HeldOutGain | None = None
    parameters: tuple[Parameter, ...] = ()
    direction: str = ""
    not_separable_from: tuple[str, ...] = ()
    by_fibre: tuple[OfFibre, ...] = ()
    log_odds: float = 0.0
    contribution_f0: float = 0.0
