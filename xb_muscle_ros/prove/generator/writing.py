"""What is public of a case: its bags and its fibre file; and what the key says of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.names import FAMILY, Name
from xb_muscle_ros.files import write_text
from xb_muscle_ros.prove.generator.case import Case, cells, size_class, trial_name
from xb_muscle_ros.prove.generator.composite import Composite
from xb_muscle_ros.prove.generator.effects import OUTSIDE
from xb_muscle_ros.prove.generator.fibres import fibre_text
from xb_muscle_ros.prove.generator.recording import Faults
from xb_muscle_ros.prove.generator.study import Planned
from xb_muscle_ros.prove.generator.world import SAMPLE_S
from xb_muscle_ros.trials.bags import write_trial
from xb_muscle_ros.trials.trial import Trial, TrialFacts

Array = npt.NDArray[np.float64]


class Recorded(Protocol):
    """What is public of a case, and the model that its fibre file names."""

    @property
    def model(self) -> str:
        """That the tool is given."""

    @property
    def nominal(self) -> dict[str, float]:
        """Constants of the fibre file."""

    @property
    def study(self) -> list[Planned]:
        """Planned trials."""

    @property
    def recorded(self) -> list[Array]:
        """Force of each, F0."""


def write_case(folder: Path, case: Recorded, fibre: str, method: str) -> None:
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
    write_text(folder / "fibre.yaml", fibre_text(fibre, case.model, method, case.nominal))


def key_entry(case: Case, name: str) -> dict[str, Any]:
    """Everything that is true of a case, as JSON can hold it."""
    spec = case.spec
    achieved = case.refitted.rms
    return {
        "case": name,
        "kind": spec.kind,
        "labels": list(spec.labels),
        "model": spec.model,
        "fibre": case.fibre,
        "asked_size_f0": spec.size,
        "size_f0": achieved,
        "size_class_f0": size_class(achieved) if spec.kind in ("single", "pair", "outside") else None,
        "before_refit_f0": case.before,
        "beside_nuisances_f0": _rms(case.beside_nuisances),
        "concealed": [{"label": c.label, "scale": c.scale, "shape": c.shape} for c in case.concealed],
        "faults": _of_faults(case.faults),
        "values": case.values,
        "refitted": case.refitted.values,
        "noise_sd_f0": {trial_name(i): sd for i, sd in enumerate(case.noise_sd)},
        "noise_rms_f0": _noise_rms(case.noise_sd, case.recorded),
        "pca": {trial_name(i): planned.pca for i, planned in enumerate(case.study)},
        "cells": cells(case.study, case.refitted.left, case.beside_nuisances),
    }


def composite_entry(case: Composite, name: str) -> dict[str, Any]:
    """Everything that is true of a composite, as JSON can hold it."""
    spec = case.spec
    effects = [
        {
            "label": c.label, "family": None if c.label in OUTSIDE else FAMILY[Name(c.label)], "scale": c.scale,
            "shape": c.shape, "asked_f0": asked, "beside_rest_f0": size,
        }
        for c, asked, size in zip(case.concealed, spec.sizes, case.sizes, strict=True)
    ]  # fmt: skip
    left_f0, left_sd = case.artefacts_left or (None, None)
    return {
        "case": name,
        "kind": spec.kind,
        "labels": [*spec.labels, *spec.artefacts],
        "model": spec.model,
        "fibre": case.fibre,
        "trials": spec.trials,
        "effects": effects,
        "artefacts": list(spec.artefacts),
        "artefacts_left_f0": left_f0,
        "artefacts_left_sd": left_sd,
        "before_refit_f0": case.before,
        "faults": _of_faults(case.faults),
        "ordinary": _of_faults(case.ordinary),
        "values": case.values,
        "noise_sd_f0": {trial_name(i): sd for i, sd in enumerate(case.noise_sd)},
        "noise_rms_f0": _noise_rms(case.noise_sd, case.recorded),
        "pca": {trial_name(i): planned.pca for i, planned in enumerate(case.study)},
    }


def _rms(parts: Sequence[Array]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(list(parts)) ** 2)))


def _noise_rms(noise_sd: Sequence[float], recorded: Sequence[Array]) -> float:
    samples = [force.size for force in recorded]
    return math.sqrt(sum(sd**2 * n for sd, n in zip(noise_sd, samples, strict=True)) / sum(samples))


def _of_faults(faults: Faults) -> dict[str, Any]:
    return {
        "pca_shift": {f"{pca:g}": shift for pca, shift in faults.pca_shift.items()},
        "length_gain": faults.length_gain,
        "run_down": faults.run_down,
        "force_offset": list(faults.offset),
        "force_drift": list(faults.drift),
        "time_shift": faults.delay_s,
        "transducer_lag": faults.lag_s,
    }
