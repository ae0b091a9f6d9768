"""Force-pCa curves of fibres and rates of force redevelopment of trials, measured and by each model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from xb_muscle_ros.evaluate.srs_table import SrsTable, levels
from xb_muscle_ros.evaluate.trials import MEASURED, Trials
from xb_muscle_ros.scores.estimate import Missing
from xb_muscle_ros.scores.force_pca import ForcePca, fit_force_pca
from xb_muscle_ros.scores.readout import ISOMETRIC
from xb_muscle_ros.scores.redevelopment import K_TR


@dataclass(frozen=True)
class ForcePcaRow:
    """Hill's equation fitted to the isometric force of a fibre, measured or by a model, or why it could not be."""

    fibre: str
    of: str
    fit: ForcePca | Missing

    def as_row(self) -> dict[str, Any]:
        """Entry of ``evaluate.json``."""
        none = dict.fromkeys(ForcePca._fields)
        return {"fibre": self.fibre, "of": self.of, **none, "why": "", **self.fit._asdict()}


@dataclass(frozen=True)
class RedevelopmentRow:
    """k_tr of a trial, measured or by a model, 1/s with standard error; or why there is no rate."""

    fibre: str
    trial: str
    pca: float | None
    of: str
    k_per_s: float | None
    se_per_s: float | None
    why: str


def force_pca_of_trials(trials: Trials) -> list[ForcePcaRow]:
    """Fits for each fibre of several pCa: measured, then by each model."""
    rows = []
    for fibre in trials.fibres:
        mine = trials.is_of(fibre) & np.isfinite(trials.pca)
        pcas = levels(trials.pca[mine])
        if pcas.size < 2:
            continue  # no one expects a curve
        for label in (MEASURED, *trials.models):
            force = trials.column(label, ISOMETRIC)[0]
            known = mine & np.isfinite(force)
            at = [force[known & np.isclose(trials.pca, pca)] for pca in pcas]
            means = np.array([np.mean(each) if each.size else np.nan for each in at])
            rows.append(ForcePcaRow(fibre, label, fit_force_pca(pcas, means)))
    return rows


def force_pca_of_table(table: SrsTable, label: str) -> list[ForcePcaRow]:
    """The same of a table of SRS and isometric force."""
    return [ForcePcaRow(name, label, fit_force_pca(table.pca, table.isometric_f0(name))) for name in table.fibres]


def redevelopment_rows(trials: Trials) -> list[RedevelopmentRow]:
    """k_tr of every trial with a release and restretch, measured and by each model; simulated rates have no error."""
    rows = []
    for label in (MEASURED, *trials.models):
        for index, facts in trials.usable():
            rate = trials.found[index].scores.get(label, {}).get(K_TR)
            if rate is not None and (rate.value is not None or rate.why):
                rows.append(RedevelopmentRow(facts.fibre, facts.trial, facts.pca, label, *rate))
    return rows
