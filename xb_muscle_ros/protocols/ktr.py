"""Rate of force redevelopment (k_tr) after release and restretch (Brenner and Eisenberg 1986), against pCa."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from xb_muscle_ros.protocols.base import Cell, Column, Found, Number, Option, Planned, Protocol, Run, Settings
from xb_muscle_ros.protocols.figures import at_level, legend, legend_of_pca, lettered, looks, shaded, shades
from xb_muscle_ros.protocols.inputs import pca_option, planned_at_each_pca, rate_option
from xb_muscle_ros.scores.estimate import Estimate, Missing, notes_of, quotient
from xb_muscle_ros.scores.readout import isometric_force
from xb_muscle_ros.scores.redevelopment import redevelopment_rate, restretch_end, still_until
from xb_muscle_ros.trials.protocol import ALLOWED, Allowed

# As in k_tr recordings of rat soleus: a fifth of the length, for 20 ms.
RELEASE_L0, RAMP_S, SLACK_S = 0.20, 0.001, 0.020
# Force at the end is a mean over this share of the time that it is followed.
_LAST = 0.02
# Of redevelopment so many of its time constants are drawn.
_DRAWN = 5.0


class RedevelopmentRates(Protocol):
    """One release and restretch at each pCa."""

    name = "ktr"
    title = "release and restretch: rate of force redevelopment (k_tr) against pCa"
    options = (
        pca_option(4.5, 5.5, 6.0, 6.1, 6.2, 6.3, 6.4, 6.6),
        Option("release", (RELEASE_L0,), Allowed(0.05, 0.5, "L0"), "how far it is released, L0", many=False),
        Option("slack", (SLACK_S,), Allowed(0.001, 0.4, "s"), "time until the restretch, s", many=False),
        Option("follow", (5.0,), Allowed(0.5, 3600.0, "s"), "time after the restretch, s", many=False),
        Option("lead", (0.1,), ALLOWED["lead_s"], "isometric time before, s", many=False),
        rate_option(1000.0),
    )
    columns: Mapping[str, Column] = {
        "trial": Column("trial"),
        "pca": Column("pCa", form="g"),
        "isometric_f0": Column("isometric force", "F0", ".3f"),
        "k_tr_per_s": Column("k_tr", "1/s", ".3f"),
        "redeveloped": Column("force at the end over that before", "", ".3f"),
    }
    numbers: Mapping[str, Column] = {
        "highest_per_s": Column("largest k_tr", "1/s", ".2f"),
        "highest_at_pca": Column("at pCa", "", "g"),
        "lowest_per_s": Column("smallest k_tr", "1/s", ".2f"),
        "lowest_at_pca": Column("at pCa", "", "g"),
    }
    source = "Brenner and Eisenberg 1986"

    def plan(self, fibre: str, settings: Settings) -> list[Planned]:
        """One trial for each pCa."""
        release, slack, follow, lead = (settings[k][0] for k in ("release", "slack", "follow", "lead"))
        steps = [
            ("isometric", lead, 0.0),
            ("release", RAMP_S, -release),
            ("hold", slack, 0.0),
            ("stretch", RAMP_S, release),
            ("recovery", follow, 0.0),
        ]
        told = {"release_l0": release, "slack_s": slack}
        return planned_at_each_pca(self.name, fibre, "ktr", steps, settings, told)

    def analyse(self, fibre: str, of: str, runs: Sequence[Run]) -> Found:
        """k_tr of each trial, and how much of the force before comes back while it is followed."""
        rows: list[Mapping[str, Cell]] = []
        notes = []
        for run in runs:
            facts = run.trial.facts
            before = isometric_force(run.trial, run.time_s, run.force_f0, run.noise)
            rate = redevelopment_rate(run.trial, run.time_s, run.force_f0, run.noise)
            if run.simulated is not None:
                rate = rate._replace(se=None)  # what an exponential misses is no noise
            restretched = restretch_end(run.trial.time_s, run.trial.length_change_l0)
            if isinstance(restretched, Missing):
                notes.append((facts.trial, f"k_tr: {rate.why or restretched.why}"))
                back = Estimate(None)
            else:
                back = _redeveloped(run, restretched, before) if rate.value is not None else Estimate(None)
            rows.append(
                {
                    "trial": facts.trial,
                    "pca": facts.pca,
                    "isometric_f0": before,
                    "k_tr_per_s": rate,
                    "redeveloped": back,
                }
            )
        found = Found(fibre, of, tuple(rows), runs=tuple(runs), notes=tuple(notes_of(notes)))
        rates, errors = found.column("k_tr_per_s"), found.errors("k_tr_per_s")
        if not np.any(np.isfinite(rates)):
            return found
        ends = {"highest": int(np.nanargmax(rates)), "lowest": int(np.nanargmin(rates))}
        pca = found.column("pca")
        numbers = {}
        for name, i in ends.items():
            numbers[f"{name}_per_s"] = _number(rates[i], errors[i])
            numbers[f"{name}_at_pca"] = Number(float(pca[i]) if np.isfinite(pca[i]) else None)
        return Found(fibre, of, found.rows, numbers, {}, found.runs, found.notes)

    def draw(self, figure: Any, found: Sequence[Found]) -> None:
        """Force after the restretch over that before, and k_tr against pCa and against force."""
        traces, by_pca, by_force = figure.subplots(1, 3, width_ratios=(1.3, 1.0, 1.0))
        levels = shades(found)
        for (look, each), level in itertools.product(looks(found), levels):
            of_level, mine = shaded(look, level), at_level(each, level)
            before = each.column("isometric_f0")
            for run, force in itertools.compress(zip(each.runs, before, strict=True), mine.tolist()):
                end_s = restretch_end(run.trial.time_s, run.trial.length_change_l0)
                if not isinstance(end_s, Missing) and np.isfinite(force) and force > 0.0:
                    traces.plot(run.time_s - end_s, run.force_f0 / force, **of_level.trace)
            rates, errors = each.column("k_tr_per_s"), each.errors("k_tr_per_s")
            for axis, x in ((by_pca, each.column("pca")), (by_force, before)):
                axis.errorbar(x[mine], rates[mine], errors[mine], **of_level.points, elinewidth=0.8)
        slowest = min((np.nanmin(each.column("k_tr_per_s")) for each in found if each.numbers), default=1.0)
        traces.set(xlabel="time after the restretch (s)", ylabel="force over that before")
        traces.set(xlim=(-0.15 * _DRAWN / slowest, _DRAWN / slowest), ylim=(-0.1, 1.4))
        by_pca.set(xlabel="pCa", ylabel="k$_{tr}$ (1/s)")
        by_pca.invert_xaxis()
        by_force.set(xlabel="isometric force (F$_0$)", ylabel="k$_{tr}$ (1/s)", xlim=(0.0, None))
        for axis in (by_pca, by_force):
            axis.set_ylim(bottom=0.0)
        legend(by_pca)
        legend_of_pca(traces, levels)
        lettered([traces, by_pca, by_force])

    def size_mm(self, found: Sequence[Found]) -> tuple[float, float]:
        """Three axes beside each other."""
        return 190.0, 70.0


def _redeveloped(run: Run, restretched_s: float, before: Estimate) -> Estimate:
    """Force over that before, in the last of the isometric time that is followed."""
    end_s = min(still_until(run.trial.time_s, run.trial.length_change_l0, restretched_s), float(run.time_s[-1]))
    from_s = end_s - _LAST * (end_s - restretched_s)
    first, last = np.searchsorted(run.time_s, [from_s - 5e-10, end_s + 5e-10]).tolist()
    inside = slice(min(first, last - 1), last)  # one sample at least, where they are far apart
    se = None if run.noise is None else run.noise.of_mean(run.time_s[inside])
    return quotient(Estimate(float(np.mean(run.force_f0[inside])), se), before._replace(why=""))


def _number(value: float, se: float) -> Number:
    if not np.isfinite(se):
        return Number(float(value))
    return Number(float(value), float(se), float(value - 1.96 * se), float(value + 1.96 * se))
