"""How each kind of number in a diagnosis was computed, in words; the report links its numbers to these."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

HOW: Mapping[str, str] = MappingProxyType(
    {
        "rmsd": (
            "Root-mean-square difference between measured and simulated force over all samples of all trials, in "
            "units of the isometric force at full calcium (F0)."
        ),
        "heldout_rmsd": (
            "The same over trials that the fit did not see: the trials are split into groups, each group is left "
            "out once and predicted by a fit to the others. Faults that are a trial's own are estimated from its "
            "force before anything moves."
        ),
        "start_rmsd": "The same for the fibre file as it was given, nothing fitted.",
        "noise": (
            "Standard deviation of force while the muscle only holds, drift taken out, from an autoregression fitted "
            "by restricted likelihood. Where trials hold for fewer than 60 evenly spaced samples in all: of what a "
            "cubic and exponentials leave of force while length stands still or, failing that, moves at a constant "
            "rate, as an autoregression or as white noise with noise that fades in time (pieces of 8 samples and more "
            "where no trial has longer ones; where there are none at all, the difference of each sample to the cubic "
            "through its neighbours). What these curves cannot "
            "follow counts as noise; noise as slow as they are is not seen. A trial that has neither is given the "
            "noise of the others, as far as they agree."
        ),
        "p_value": (
            "Parametric bootstrap: noise of the size and colour of that of the recordings (with what is not known "
            "of them) is put through the fit's normal equations, and the largest excess over all places is "
            "compared with the recording's. All places together are wrong no more often than this."
        ),
        "mismatch": (
            "Root mean square of measured minus simulated force in one phase of one trial, after the base model's "
            "parameters were fitted. A place counts where chance is ruled out and the size exceeds 0.3 % F0."
        ),
        "cell_p_value": (
            "From the same bootstrap, place by place (step-down maxima), so that all places can be looked at together."
        ),
        "map": "Residual of every phase of every trial; long pauses are split into their first 0.1 s and the rest.",
        "conflicts": (
            "Each part fitted by itself from where the fit of all ended, to first order and with the same priors: what "
            "that takes off the mean square, noise taken off both."
        ),
        "confidence": (
            "Weight of the answer among everything that was fitted in its place, from how far each one is from "
            "the data (a likelihood with two independent differences in each trial), times the share of the "
            "mismatch that it explains. Where nothing is named there is none: that an effect is absent has no "
            "probability here, only how often noise leaves as much."
        ),
        "heldout_gain": (
            "Geometric mean over held-out trials of each one's error, base and explanation. For a mechanism the error "
            "over all samples has to fall by a tenth and 0.3 % F0 of mean square, for faults of the measurement this "
            "one, and the predictive score has to rise by more than its standard error over trials."
        ),
        "delta_elpd": (
            "Sum over held-out trials of the logarithm of the ratio of the two errors: above 0 where the "
            "candidate predicts better than the base. Each trial counts once; the standard error is over trials."
        ),
        "candidates": (
            "Every explanation that was fitted beside the base model's parameters, and those that were left out "
            "because to first order, with everything fitted so far giving way, they could not take enough off the "
            "misfit."
        ),
        "parameters": (
            "Fitted values of the explanation's own parameters and faults, together with all parameters of the "
            "base model."
        ),
        "interval": (
            "95 % interval from the profile of the objective (quick: from its curvature), widened for differences "
            "that hang together in time."
        ),
        "profile": "Root of the likelihood ratio at values of the parameter, everything else fitted again at each.",
        "flexible_bound": (
            "Held-out error with a discrepancy that knows no physics (memories of stretch and shortening, length, "
            "scaled in every way) learnt from the other trials: what could be told at all."
        ),
        "kernel": (
            "Non-negative weights of memories of stretch (each fades with its own time constant) that tell what "
            "the base left, in trials left out; scaled by nothing, calcium, activation or force, whichever tells "
            "most."
        ),
        "nuisances": "Values of faults of the measurement that were fitted beside the parameters, within their priors.",
        "base_parameters": (
            "Parameters of the base model that were fitted, from the values of the fibre file, with priors of a "
            "factor of e either way. The Gaussian form of the strain distribution has an error of its own; the "
            "difference to the full distribution at the fitted point is added in every fit, so that no mechanism "
            "is called upon to explain it."
        ),
        "checks": "Conditions that must all hold before a mechanism is named.",
        "next_experiment": (
            "Of a menu of ramps (speeds, directions, starting lengths, calcium) the one on which the two "
            "explanations, as fitted, differ most."
        ),
        "run": "Time, seed of the bootstrap and how hard was looked.",
    }
)
