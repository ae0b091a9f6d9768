"""Whole fibres left out: what the other fibres' effects predict of a fibre whose own are not fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from xb_muscle_ros.diagnose.inference.population import distribution
from xb_muscle_ros.diagnose.names import MEASUREMENT
from xb_muscle_ros.diagnose.search.descent import Descent
from xb_muscle_ros.diagnose.search.system import Names
from xb_muscle_ros.diagnose.searching import Searched
from xb_muscle_ros.errors import UserError


def left_out(study: Searched, chosen: Names) -> list[tuple[float, float] | None]:
    """For each fibre the RMSD of the base and of the answer with the other fibres' effects, F0.

    Both have the fibre's own constants and measurement errors fitted; the effects of the answer are those at the
    centre of the other fibres' distribution, so that neither has more that is its own.
    """
    explorer = study.explorer
    names = tuple(n for n in chosen if n not in MEASUREMENT)
    if names not in explorer.fits:
        explorer.fit([(names, [[f.values] for f in explorer.fits[chosen]])], "mechanisms alone")
    if not names or names not in explorer.fits:
        return [None] * len(study.fibres)
    estimates = explorer.estimates(names)
    rows: list[tuple[float, float] | None] = []
    for i, (system, recorded) in enumerate(zip(explorer.systems, study.recorded, strict=True)):
        problem = system.problem(names, explorer.fits[names][i].values)
        common = {}
        for c in problem.coordinates:
            if c.label in estimates:
                others = [e for k, e in enumerate(estimates[c.label]) if k != i]
                common[c.label] = c.outward(distribution(others).mean)
        values = {**explorer.fits[names][i].values, **common}
        made = system.problem(names, values)
        free = [j for j, c in enumerate(made.coordinates) if c.label not in common]
        fixed = replace(made.fibre, values={**made.fibre.values, **common})
        held = replace(made, fibre=fixed, coordinates=tuple(made.coordinates[j] for j in free))
        try:
            descent = Descent(system, held)
            point, _ = descent.walk(held.start, explorer.effort.most, explorer.effort.tolerance)
        except (UserError, np.linalg.LinAlgError):
            rows.append(None)
            continue
        every = replace(held, trials=recorded.trials, correction=recorded.problem(names, values).correction)
        try:
            forces = every.predicted(point.z)
        except UserError:
            rows.append(None)
            continue
        residual = np.concatenate([f - t.measured_f0 for f, t in zip(forces, recorded.trials, strict=True)])
        base = study.around((), i).residual_f0
        rows.append((float(np.sqrt(np.mean(base**2))), float(np.sqrt(np.mean(residual**2)))))
    return rows
