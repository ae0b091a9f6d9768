"""The one glossary of a diagnosis: its page, its JSON and its terminal text explain their terms from here."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple


class Term(NamedTuple):
    """One entry.

    Attributes:
        title: as the glossary lists it.
        text: a sentence or two.
    """

    title: str
    text: str


GLOSSARY: Mapping[str, Term] = MappingProxyType(
    {
        "base": Term(
            "Base model",
            "The model of the fibre file. Its parameters and the ordinary measurement artefacts are fitted to all "
            "trials; nothing is added.",
        ),
        "answer": Term(
            "Answer",
            "The base model with every component whose inclusion probability is 0.5 or more, fitted in the same way.",
        ),
        "component": Term(
            "Component",
            "A mechanism that the base model may lack, or a measurement artefact beyond what is ordinary. A family "
            "whose members the recordings cannot tell apart is one component.",
        ),
        "inclusion_probability": Term(
            "Inclusion probability",
            "Probability that a component is part of the truth, given these recordings and the candidates on offer: "
            "the sum of the probabilities of all sets of mechanisms that contain it. It says nothing of effects that "
            "no candidate describes.",
        ),
        "replication": Term(
            "Replication",
            "A fibre replicates a component where its own recordings speak for what the other fibres show: with the "
            "effect distributed as in the others, its log Bayes factor is 1 or more (2.7 to 1).",
        ),
        "ablation_loss": Term(
            "Ablation loss",
            "The fraction of the base model's mismatch (mean square beyond noise) that the answer explains with "
            "this component and does not explain without it, all else fitted anew. Ablation losses need not add up "
            "to the explained fraction.",
        ),
        "explained_fraction": Term(
            "Explained fraction",
            "The fraction of the base model's mismatch, as mean square beyond noise, that the answer as a whole "
            "removes.",
        ),
        "heldout": Term(
            "Held out",
            "Not shown to a fit and predicted by it: every condition in turn, and in a study of several fibres "
            "every fibre.",
        ),
        "heldout_gain": Term(
            "Held-out gain",
            "Logarithm of the held-out force RMSD without a component over that with it: mean and standard error "
            "over the held-out conditions. A gain of 0.10 means an error lower by about 10 %; below 0 the error is "
            "higher.",
        ),
        "interval": Term(
            "Interval",
            "95 % interval of a parameter, given that the component is part of the truth. The probability that it is "
            "absent is the inclusion probability's, not the interval's.",
        ),
        "at_bound": Term(
            "At bound", "The estimate ended at the edge of what the parameter may be, so its interval is one-sided."
        ),
        "spread": Term(
            "Spread over fibres", "Standard deviation of a parameter over the fibres of the study, in its own unit."
        ),
        "direction": Term("Direction", "What a component does to the force as it was fitted, in words."),
        "not_separable_from": Term(
            "Not separable from",
            "Components with which this one trades probability: a set that has one of them seldom needs the other. "
            "The recordings tell that one of them is there better than which.",
        ),
        "family": Term(
            "Family", "Mechanisms that act on the same thing in nearly the same way, so that few recordings part them."
        ),
        "artefact": Term(
            "Measurement artefact",
            "An error of the recording, such as a transducer that drifts. It is named only where its estimate lies "
            "beyond what is ordinary.",
        ),
        "ordinary_artefact": Term(
            "Ordinary measurement artefact",
            "What every recording has a little of: pCa of a solution, time shift, run-down, force offset, length "
            "gain. They are nuisance parameters of every model, the base included, with priors as wide as real "
            "recordings show.",
        ),
        "prior_sd": Term(
            "Ordinary size",
            "Prior standard deviation of an ordinary measurement artefact.",
        ),
        "mismatch": Term(
            "Mismatch",
            "Measured less simulated force of the base model, where it stands out beyond noise. Its size is a root "
            "mean square; its sign is that of the mean.",
        ),
        "p_value": Term(
            "p-value",
            "Probability that noise, put through the same fit, leaves as much anywhere; family-wise over all "
            'places. "≤" stands where the bootstrap can give no lower value.',
        ),
        "residual": Term(
            "Residual",
            "Measured less simulated force with the answer's model: its RMSD, and the places where it stands out "
            "beyond noise.",
        ),
        "law": Term(
            "Residual law",
            "A Prony series (non-negative sum of exponentials) in the length change that describes a residual, and "
            "what it scales with. It describes and does not explain.",
        ),
        "law_share": Term(
            "Described by the law",
            "Fraction of the residual's mean square that its law explains in held-out trials.",
        ),
        "benchmark": Term(
            "Non-parametric discrepancy benchmark",
            "Held-out force RMSD of the base model plus a discrepancy without physics that is learnt from the other "
            "trials: what could be predicted at all. Where it is above the base model's, nothing could be learnt "
            "so.",
        ),
        "rmsd": Term(
            "Force RMSD",
            "Root mean square of measured less simulated force over all samples, in % of the isometric force at full "
            "calcium (F0).",
        ),
        "noise": Term(
            "Noise",
            "Standard deviation of measured force that is not the fibre's, estimated trial by trial.",
        ),
        "set": Term(
            "Set of mechanisms",
            "One combination of components. Probabilities are averages over all sets considered, fitted or predicted "
            "to first order from a fitted neighbour.",
        ),
        "log_evidence": Term(
            "Log evidence",
            "Logarithm of the probability of the recordings under a set, relative to the best set. Data count by "
            "their effective sample size.",
        ),
        "heldout_fibre": Term(
            "Held-out fibre",
            "Force RMSD of a fibre whose effects are taken from the other fibres; its own constants and measurement "
            "artefacts are fitted.",
        ),
        "closure": Term(
            "Error of the Gaussian form",
            "What the Gaussian form of the strain distribution itself gets wrong at the fitted point. It is "
            "computed with the full distribution and taken out of every fit.",
        ),
        "feature": Term(
            "Feature",
            "A tabulated quantity such as short-range stiffness (SRS) or isometric force, used in the fit or held out "
            "and predicted.",
        ),
        "next_experiment": Term(
            "Expected difference",
            "Root mean square of the difference between the forces that the two models predict for the protocol "
            "proposed.",
        ),
    }
)
"""Every term by its key."""
