"""A diagnosis: one frozen record that the JSON, the prose, the page and the figures read.

Forces are in units of F0, lengths in L0, times in s. Shares are fractions of the mismatch's mean square beyond noise.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, field

from xb_muscle_ros.diagnose.component import NAMED, Component, HeldOutGain
from xb_muscle_ros.diagnose.residual import AnswerResidual, Place, ResidualLaw, ResidualMap

FORMAT = 3
"""Version of `diagnosis.json`; `report.codec` has the keys of former ones."""


class Verdict(str, enum.Enum):
    """What a diagnosis says as a whole."""

    NONE = "none"
    """The fibre file as given is as good as the data can tell."""
    MEASUREMENT = "measurement"
    """Measurement artefacts beyond the ordinary, and no physics."""
    PARAMETERS = "parameters"
    """Other values of the same parameters are enough."""
    PHYSICS = "physics"
    """At least one mechanism is sure and predicts held-out conditions better; it may explain only a part."""
    AMBIGUOUS = "ambiguous"
    """Mechanisms have evidence, but none is sure or none predicts better beyond its standard error."""
    UNEXPLAINED = "unexplained"
    """There is a mismatch, and nothing has evidence."""


@dataclass(frozen=True)
class Scores:
    """How far one model is from the recordings, F0.

    Attributes:
        names: mechanisms and artefacts in it beside the base; empty: the base.
        train_rmsd_f0: fitted to all trials.
        heldout_rmsd_f0: of conditions left out of the fit; None where none were.
    """

    names: tuple[str, ...]
    train_rmsd_f0: float
    heldout_rmsd_f0: float | None


@dataclass(frozen=True)
class SetOfMechanisms:
    """One of the sets that were averaged over.

    Attributes:
        names: in it; empty: the base.
        probability: of the set, among all sets considered.
        log_evidence: relative to the best set.
        rmsd_f0: after its fit, or as predicted to first order.
        fitted: whether it was fitted, rather than predicted from a neighbour.
    """

    names: tuple[str, ...]
    probability: float
    log_evidence: float
    rmsd_f0: float
    fitted: bool


@dataclass(frozen=True)
class NuisanceParameter:
    """An ordinary measurement artefact as estimated: a nuisance parameter of every model.

    Attributes:
        name, group: of the artefact; group: the solution or trial, empty for the whole study.
        unit: of value, sd and prior_sd.
        value: estimate with the answer's model.
        prior_sd: what is ordinary.
        before: estimate with the base; None where the base does not have it.
    """

    fibre: str
    name: str
    group: str
    unit: str
    value: float
    sd: float | None
    prior_sd: float
    before: float | None = None


@dataclass(frozen=True)
class OfTrial:
    """One trial before and after.

    Attributes:
        phases: name, start and end in s.
        noise_sd_f0, noise_source, noise_samples: of its force; `noise_source` as in `scores.noise.model.Source`.
        before_rmsd_f0, after_rmsd_f0: base and answer, fitted to all trials.
        heldout_before_f0, heldout_after_f0: predicted by fits that did not see its condition; None where none was
            left out.
    """

    fibre: str
    trial: str
    pca: float | None
    phases: tuple[tuple[str, float, float], ...]
    noise_sd_f0: float
    noise_source: str
    noise_samples: int
    before_rmsd_f0: float
    after_rmsd_f0: float
    heldout_before_f0: float | None
    heldout_after_f0: float | None


@dataclass(frozen=True)
class OfStudyFibre:
    """One fibre of the study as a whole.

    Attributes:
        answer: names with probability of `NAMED` and more from this fibre alone.
        before, after: base, and the study's answer fitted to this fibre.
        left_out_rmsd_f0: this fibre predicted with effects as the other fibres have them, base and answer, F0; None
            where there are no others.
        p_value: of its mismatch.
        base_parameters: name, value in the fibre file, fitted value with the base alone, unit.
        closure_f0: what the Gaussian form's own error amounts to here, F0; 0 where it was not taken out.
    """

    fibre: str
    model: str
    trials: int
    answer: tuple[str, ...]
    before: Scores
    after: Scores
    left_out_rmsd_f0: tuple[float, float] | None
    p_value: float
    base_parameters: tuple[tuple[str, float, float, str], ...]
    closure_f0: float


@dataclass(frozen=True)
class Feature:
    """A tabulated feature, measured and predicted.

    Attributes:
        name: ``isometric force`` (F0) or ``SRS`` (F0/L0).
        condition: in words: pCa, amplitude, recovery.
        measured, before, after: value, by the base and by the answer.
        used: whether the fit had it; else it was predicted.
        traced: whether a trace of the study has the stretch or the rest that it was measured in.
    """

    fibre: str
    name: str
    condition: str
    measured: float
    before: float
    after: float
    used: bool
    traced: bool = False


@dataclass(frozen=True)
class FeatureScore:
    """RMSD of relative SRS, predicted and measured, at conditions that no trace has.

    Attributes:
        reading: of docs/evaluate.md: ``text`` or ``released``.
        conditions: set of conditions: ``large``, ``small`` or ``all`` reductions of SRS.
        before, after: by base and answer.
    """

    reading: str
    conditions: str
    count: int
    before: float
    after: float


@dataclass(frozen=True)
class NextExperiment:
    """What to record next.

    Attributes:
        bag: folder with the protocol.
        protocol: in words.
        separates: names of the components that it separates.
        expected_difference_f0: between the two models on it, root mean square, F0.
    """

    bag: str
    protocol: str
    separates: tuple[str, ...]
    expected_difference_f0: float


@dataclass(frozen=True)
class Diagnosis:
    """All that a diagnosis found.

    Attributes:
        fibres: in the order given.
        model, method: of the base.
        quick, seed, seconds: how it was made.
        answer: mechanisms with an inclusion probability of `NAMED` or more, best first.
        components: all candidates, the most probable first.
        explained_fraction: of the mismatch by the answer.
        mismatch: where the base differs, the largest first.
        p_value: chance that noise leaves as much as the base did.
        described: False where the base does not describe the recordings at all, or noise hides everything.
        residual: what the answer leaves.
        base_law: describes the base's residual; None where none holds.
        before, after: scores of base and answer.
        heldout_gain: of the answer as a whole; None where nothing was left out.
        benchmark_rmsd_f0: held-out RMSD of a non-parametric discrepancy benchmark; None where there is none.
        sets: sets averaged over, the most probable first.
        by_fibre, trials, nuisance_parameters, features, feature_scores: rows.
        map_before, map_after: residual of base and answer by trial and phase, by fibre.
        next_experiment: None where nothing is to be separated.
        augmented: files of the augmented fibres, by fibre; empty where the answer has no mechanism.
        warnings: a line each, such as absurd forces outside the study.
        missing: what a firmer answer needs, a line each.
        notes: what was assumed, skipped or left out, a line each.
        p_value_floor: the bootstrap gives no lower p-value of one fibre; 0 where that is unknown.
    """

    format_version: int
    fibres: tuple[str, ...]
    model: str
    method: str
    quick: bool
    seed: int
    seconds: float
    verdict: Verdict
    answer: tuple[str, ...]
    components: tuple[Component, ...]
    explained_fraction: float
    mismatch: tuple[Place, ...]
    p_value: float
    described: bool
    residual: AnswerResidual
    base_law: ResidualLaw | None
    before: Scores
    after: Scores
    heldout_gain: HeldOutGain | None
    benchmark_rmsd_f0: float | None
    sets: tuple[SetOfMechanisms, ...]
    by_fibre: tuple[OfStudyFibre, ...]
    trials: tuple[OfTrial, ...]
    nuisance_parameters: tuple[NuisanceParameter, ...]
    features: tuple[Feature, ...] = ()
    feature_scores: tuple[FeatureScore, ...] = ()
    map_before: dict[str, ResidualMap] = field(default_factory=dict)
    map_after: dict[str, ResidualMap] = field(default_factory=dict)
    next_experiment: NextExperiment | None = None
    augmented: dict[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    p_value_floor: float = 0.0

    @property
    def benchmark_is_beaten(self) -> bool:
        """Whether the base predicts better than the benchmark, which then says nothing of what could be predicted."""
        base, benchmark = self.before.heldout_rmsd_f0, self.benchmark_rmsd_f0
        return base is not None and benchmark is not None and benchmark > base

    @property
    def named(self) -> tuple[Component, ...]:
        """Components with probability of `NAMED` and more, mechanisms and artefacts."""
        return tuple(c for c in self.components if c.inclusion_probability >= NAMED)
