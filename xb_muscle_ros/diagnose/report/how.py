"""How each number was computed: what the tool wrote down, else the definition."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from xb_muscle_ros.diagnose.report.markup import anchor, prose


class Kind(NamedTuple):
    """One kind of number.

    Attributes:
        title: what it is called in the list.
        definition: what it means; stands where the tool wrote nothing about its computing.
    """

    title: str
    definition: str


KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "rmsd": Kind(
            "Force RMSD, trials fitted",
            "Root of the mean square of measured minus modelled force, over all samples of the trials fitted.",
        ),
        "heldout_rmsd": Kind(
            "Force RMSD, trials left out",
            "The same for trials that the fit did not see: each was predicted from a fit to the others.",
        ),
        "start_rmsd": Kind(
            "Force RMSD of the fibre file", "Force RMSD of the model with the values of the fibre file as it was given."
        ),
        "noise": Kind("Noise", "Standard deviation of the measured force beside all that the fibre does."),
        "p_value": Kind(
            "Chance",
            "Share of simulated repeats of the recordings, made by the fitted model with noise like the measured, in "
            "which as much is left after the same fit.",
        ),
        "mismatch": Kind(
            "Size of a mismatch",
            "Root mean square of measured minus modelled force within the span; its sign is that of the mean.",
        ),
        "cell_p_value": Kind(
            "p of a mismatch or cell",
            "Chance that any of the places looked at shows as much: corrected for looking at many.",
        ),
        "map": Kind("Cells of the map", "Mean and root mean square of measured minus modelled force in the phase."),
        "conflicts": Kind(
            "Own parameters for parts of the study",
            "Share of the mismatch's mean square that is gone if each part has parameters of its own.",
        ),
        "confidence": Kind(
            "Confidence",
            "Weight of the answer among all that was fitted in its place, from how far each is from the data.",
        ),
        "heldout_gain": Kind(
            "Usual error of a trial left out", "Geometric mean of the force RMSDs of the single trials left out."
        ),
        "delta_elpd": Kind(
            "Difference in predictive score",
            "Log density that a candidate gives to trials left out, summed over trials, minus that of the reference; "
            "the standard error is over trials.",
        ),
        "candidates": Kind("Number of explanations", "Candidates that were looked at, without the base model."),
        "parameters": Kind("Parameters of a candidate", "Values at the best fit of the candidate."),
        "interval": Kind(
            "Interval of a parameter",
            "Values that the recordings do not contradict, all else fitted anew: see profile.",
        ),
        "profile": Kind(
            "Profile",
            "Root of the likelihood ratio between the best fit and the best fit with this parameter held at a value.",
        ),
        "flexible_bound": Kind(
            "Flexible curve",
            "Force RMSD on trials left out of a smooth description of the residual that knows no physics: what any "
            "mechanism may hope for.",
        ),
        "kernel": Kind(
            "Memory of the residual",
            "Non-negative weights of exponentials of the velocity's history, fitted to the residual; the share is of "
            "its mean square.",
        ),
        "nuisances": Kind(
            "Corrections of the measurement",
            "Estimated with the parameters, each held near zero by what is known of such faults (± expected).",
        ),
        "base_parameters": Kind("Parameters of the model", "Values at the best fit of the base model."),
        "checks": Kind("Checks", "Conditions for naming a mechanism, each with the value that was compared."),
        "next_experiment": Kind(
            "Expected difference", "Largest difference of the rivals' forces in the protocol proposed, as simulated."
        ),
        "run": Kind("Facts of the run", "Seed of all random numbers, time taken, and version of the file."),
    }
)
"""Kinds of number on the page, by the key of ``how`` that tells of them."""


def how_section(linked: Iterable[str], told: Mapping[str, object]) -> str:
    """The list that numbers link to: all that is linked, then what else the tool told."""
    rows = []
    for key in dict.fromkeys([*linked, *told]):
        kind = KINDS.get(key)
        title = kind.title if kind else key.replace("_", " ")
        text = told.get(key) or (kind.definition if kind else "")
        rows.append(f'<div id="{anchor(key)}"><dt>{prose(title)}</dt><dd>{prose(text)}</dd></div>')
    return f"<dl>{''.join(rows)}</dl>"
