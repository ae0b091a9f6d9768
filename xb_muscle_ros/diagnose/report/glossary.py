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
            "The model of the fibre file with its parameters and ordinary measurement errors fitted to all trials, and "
            "nothing added.",
        ),
        "answer": Term(
            "Answer",
            "The base model with every mechanism and artefact whose inclusion probability is 0.5 or more, fitted in "
            "the same way.",
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
        "share_of_mismatch": Term(
            "Share of mismatch",
            "Ablation loss: what of the base model's mismatch comes back if this component alone is taken out of the "
            "answer. It is a fraction of the mean square beyond noise; shares of several components need not add up "
            "to what they explain together.",
        ),
        "explained_share": Term(
            "Explained share",
            "Fraction of the base model's mismatch, as mean square beyond noise, that the answer as a whole removes.",
        ),
        "heldout": Term(
            "Held out",
            "Left out of the fit and predicted by it: every condition in turn, and in a study of several fibres every "
            "fibre.",
        ),
        "heldout_gain": Term(
            "Held-out gain",
            "Logarithm of the held-out force RMSD without a component over that with it, as mean and standard error "
            "over the conditions left out. 0.10 means that the error falls by about 10 %; below 0 it rises.",
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
            "Components with which this one trades probability: a set that has one of them seldom needs the other. The "
            "recordings tell better that one of them is there than which.",
        ),
        "family": Term(
            "Family", "Mechanisms that act on the same thing in nearly the same way, so that few recordings part them."
        ),
        "artefact": Term(
            "Measurement artefact",
            "An error of the recording, such as a transducer that drifts. It is named only where its estimate lies "
            "beyond what is ordinary.",
        ),
        "ordinary_error": Term(
            "Ordinary measurement error",
            "Errors that every recording has (pCa of a solution, time shift, run-down, force offset, length gain and "
            "the like). They are nuisance parameters of every model, the base included, with priors as wide as real "
            "recordings show.",
        ),
        "prior_sd": Term("Ordinary size", "Prior standard deviation of an ordinary measurement error."),
        "mismatch": Term(
            "Mismatch",
            "Measured less simulated force of the base model, where it stands out beyond noise. Its size is a root "
            "mean square; its sign is that of the mean.",
        ),
        "p_value": Term(
            "p-value",
            "Chance that noise, put through the same fit, leaves as much anywhere: corrected for all places looked at.",
        ),
        "remaining": Term(
            "Remaining", "Force RMSD that the answer leaves, and the places where it stands out beyond noise."
        ),
        "law": Term(
            "Law",
            "What a residual follows: a weighted sum of memories of stretch, each fading with its own time constant, "
            "and what it scales with. It describes and does not explain.",
        ),
        "law_share": Term(
            "Described by the law", "Share of the residual's mean square that its law predicts in trials left out."
        ),
        "benchmark": Term(
            "Non-parametric discrepancy benchmark",
            "Held-out force RMSD of the base model plus a flexible discrepancy that knows no physics, learnt from the "
            "other trials: what could be predicted at all.",
        ),
        "rmsd": Term(
            "Force RMSD",
            "Root mean square of measured less simulated force over all samples, in % of the isometric force at full "
            "calcium (F0).",
        ),
        "noise": Term(
            "Noise",
            "Standard deviation of the measured force beside all that the fibre does, estimated trial by trial.",
        ),
        "set": Term(
            "Set of mechanisms",
            "One combination of components. Probabilities are averages over all sets considered, fitted or predicted "
            "to first order from a fitted neighbour.",
        ),
        "log_evidence": Term(
            "Log evidence",
            "Logarithm of the probability of the recordings under a set, relative to the best set, with data that "
            "count as often as they are independent.",
        ),
        "left_out_fibre": Term(
            "Fibre left out",
            "Force RMSD of a fibre whose effects are taken from the other fibres; its own constants and measurement "
            "errors are fitted.",
        ),
        "closure": Term(
            "Error of the Gaussian form",
            "What the Gaussian form of the strain distribution itself gets wrong at the fitted point; it is computed "
            "with the full distribution and taken out of every fit.",
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


def how() -> dict[str, str]:
    """Text of every term by its key: what ``how`` in `diagnosis.json` holds."""
    return {key: term.text for key, term in GLOSSARY.items()}
