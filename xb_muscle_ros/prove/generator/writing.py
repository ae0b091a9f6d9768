"""What is public of a case: its bags and its fibre file; and what the key says of it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.files import write_text
from xb_muscle_ros.prove.generator.case import Case, trial_name
from xb_muscle_ros.prove.generator.fibres import fibre_text
from xb_muscle_ros.prove.generator.world import SAMPLE_S
from xb_muscle_ros.trials.bags import write_trial
from xb_muscle_ros.trials.trial import Trial, TrialFacts


def write_case(folder: Path, case: Case, fibre: str, method: str) -> None:
    """Write the bags, and last of all the fibre file: where that is, the case is complete.

    Raises:
        UserError: a file cannot be written.
    """
    for i, (planned, force) in enumerate(zip(case.study, case.recorded, strict=True)):
        facts = TrialFacts(
            fibre, trial_name(i), planned.pca, planned.amplitude_l0, planned.recovery_s, phases=planned.phases
        )
        time_s = np.arange(force.size) * SAMPLE_S
        trial = Trial(
            facts, time_s, 1.0 + planned.length, np.zeros(1), np.array([10.0 ** (6.0 - planned.pca)]), time_s, force
        )
        bag = folder / "bags" / trial_name(i)
        bag.parent.mkdir(parents=True, exist_ok=True)
        write_trial(bag, trial)
    write_text(folder / "fibre.yaml", fibre_text(fibre, case.spec.model, method, case.nominal))


def key_entry(case: Case, name: str) -> dict[str, Any]:
    """Everything that is true of a case, as JSON can hold it."""
    spec, samples = case.spec, [force.size for force in case.recorded]
    return {
        "case": name,
        "kind": spec.kind,
        "labels": [*spec.labels, *spec.artefacts],
        "model": spec.model,
        "fibre": case.fibre,
        "before_refit_f0": case.before,
        "artefact_sizes": case.artefacts.as_json(),
        "values": case.values,
        "noise_sd_f0": {trial_name(i): sd for i, sd in enumerate(case.noise_sd)},
        "noise_rms_f0": math.sqrt(sum(sd**2 * n for sd, n in zip(case.noise_sd, samples, strict=True)) / sum(samples)),
        "pca": {trial_name(i): planned.pca for i, planned in enumerate(case.study)},
        **case.facts(),
    }
