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
        "p_value": (
            "Parametric bootstrap: noise of the size and colour of the isometric windows (with what is not known "
            "of them) is put through the fit's normal equations, and the largest excess over all places is "
            "compared with the recording's. All places together are wrong no more often than this."
        ),
        "noise": (
            "Standard deviation of force in the isometric window, drift taken out, from an autoregression fitted "
            "by restricted likelihood."
        ),
        "mismatch": (
            "Root mean square of measured minus simulated force in one phase of one trial, after the base model's "
            "parameters were fitted. A place counts where chance is ruled out and the size exceeds 0.3 % F0."
        ),
        "confidence": (
            "Weight of the answer among everything that was fitted in its place, from how far each one is from "
            "the data (a likelihood with two independent differences in each trial), times the share of the "
            "mismatch that it explains."
        ),
        "delta_elpd": (
            "Sum over held-out trials of the logarithm of the ratio of the two errors: above 0 where the "
            "candidate predicts better than the base. Each trial counts once; the standard error is over trials."
        ),
        "interval": (
            "95 % interval from the profile of the objective (quick: from its curvature), widened for differences "
            "that hang together in time."
        ),
        "kernel": (
            "Non-negative weights of memories of stretch (each fades with its own time constant) that tell what "
            "the base left, in trials left out; scaled by nothing, calcium, activation or force, whichever tells "
            "most."
        ),
        "explained": "Share of the mean square beyond noise that is gone.",
        "flexible": (
            "Held-out error with a discrepancy that knows no physics (memories of stretch and shortening, length, "
            "scaled in every way) learnt from the other trials: what could be told at all."
        ),
        "closure": (
            "The Gaussian form of the strain distribution has an error of its own; the difference to the full "
            "distribution at the fitted point is added in every fit, so that no mechanism is called upon to "
            "explain it."
        ),
        "nuisance": "Value of a fault of the measurement that was fitted beside the parameters, within its prior.",
        "next_experiment": (
            "Of a menu of ramps (speeds, directions, starting lengths, calcium) the one on which the two "
            "explanations, as fitted, differ most."
        ),
    }
)
