"""Ramps of constant velocity: force against velocity on both sides of isometric."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.protocols import force_velocity_curve as curve
from xb_muscle_ros.protocols.base import Cell, Column, Found, Option, Planned, Protocol, Run, Settings
from xb_muscle_ros.protocols.inputs import facts_of, pca_option, planned_between, rate_option
from xb_muscle_ros.scores.estimate import Estimate, quotient
from xb_muscle_ros.scores.readout import isometric_force
from xb_muscle_ros.trials.protocol import ALLOWED, Allowed
from xb_muscle_ros.trials.trial import Phase

Bools = npt.NDArray[np.bool_]

# Force is read where length passes the middle of the ramp: a mean over this share of its duration.
_SHARE = 0.05
# Force that changes by more than this share in the last fifth of the way to the middle of the ramp is not steady.
_STEADY = 0.03
_MOVING = ("stretch", "shortening", "release", "test_stretch")


class ConstantVelocities(Protocol):
    """One velocity in each trial."""

    name = "force-velocity"
    title = "ramps of constant velocity: force against velocity, on both sides of isometric"
    options = (
        pca_option(4.5),
        Option(
            "velocity", (-1.0, -0.7, -0.5, -0.35, -0.25, -0.15, -0.1, -0.05, 0.05, 0.1, 0.25, 0.5),
            Allowed(-50.0, 50.0, "L0/s"), "of length, L0/s; negative shortens",
        ),
        Option("amplitude", (0.2,), Allowed(0.0, 0.5, "L0", True), "of the ramp around rest length, L0", many=False),
        Option("lead", (0.1,), ALLOWED["lead_s"], "isometric time before, s", many=False),
        rate_option(5000.0),
    )  # fmt: skip
    columns: Mapping[str, Column] = {
        **curve.OF_TRIAL,
        "shortening_l0_per_s": Column("velocity of shortening", "L0/s", ".4g"),
        "force_f0": Column("force at mid-ramp", "F0", ".4f"),
        "load": Column("over isometric force", "", ".4f"),
        **curve.POWER,
    }
    numbers = curve.NUMBERS
    source = "e.g. Edman 1988"

    def plan(self, fibre: str, settings: Settings) -> list[Planned]:
        """One trial for each pCa and velocity, from one side of rest length to the other.

        Raises:
            UserError: a velocity is zero.
        """
        amplitude, lead, rate = (settings[k][0] for k in ("amplitude", "lead", "rate"))
        planned = []
        for pca, speed in itertools.product(settings["pca"], settings["velocity"]):
            if speed == 0.0:
                raise UserError(
                    "--velocity is 0 L0/s; a ramp needs a velocity, and the isometric force is that before it"
                )
            rise = amplitude if speed > 0.0 else -amplitude
            name = f"velocity_{'plus' if speed > 0.0 else 'minus'}{abs(speed):g}_pca{10.0 * pca:g}"
            told = {"pca": pca, "velocity_l0_per_s": speed, "amplitude_l0": amplitude}
            moved = "stretch" if speed > 0.0 else "shortening"
            steps = [("isometric", lead, 0.0), (moved, amplitude / abs(speed), rise)]
            made = planned_between(facts_of(self.name, fibre, name, told), steps, pca, rate)
            start = -0.5 * rise
            trial = replace(made.trial, length_m=made.trial.length_m + start)
            planned.append(Planned(trial, made.corner_s, made.corner_l0 + start))
        return planned

    def analyse(self, fibre: str, of: str, runs: Sequence[Run]) -> Found:
        """Force where length passes the middle of each ramp, and Hill's hyperbola through those of shortening."""
        rows: list[Mapping[str, Cell]] = []
        told: list[tuple[str, str]] = []
        for run in runs:
            row, why = _row(run)
            rows.append(row)
            told += [(run.trial.facts.trial, why)] if why else []
        return curve.found_of(fibre, of, runs, rows, told, False)

    def draw(self, figure: Any, found: Sequence[Found]) -> None:
        """Force against time, velocity and power against force."""
        curve.draw(figure, found, "force")

    def size_mm(self, found: Sequence[Found]) -> tuple[float, float]:
        """Three axes beside each other."""
        return curve.SIZE_MM


def _ramp(run: Run) -> Phase | None:
    moving = [phase for phase in run.trial.facts.phases if phase.name in _MOVING]
    others = [phase for phase in run.trial.facts.phases if phase.name == "conditioning_stretch"]
    return moving[0] if len(moving) == 1 and not others else None


def _row(run: Run) -> tuple[Mapping[str, Cell], str]:
    """A row, and why it lacks what it lacks."""
    facts = run.trial.facts
    before = isometric_force(run.trial, run.time_s, run.force_f0, run.noise)
    row: dict[str, Cell] = {"trial": facts.trial, "pca": facts.pca, "isometric_f0": before}
    phase = _ramp(run)
    if phase is None:
        return row, "ramp: there is no single stretch or shortening"
    lasts_s = phase.end_s - phase.start_s
    speed = run.setting("velocity_l0_per_s")
    if speed is None:
        # The corners are cut off by samples and filters: the middle half of the ramp tells its speed.
        ends = phase.start_s + lasts_s * np.array([0.25, 0.75])
        low, high = np.interp(ends, run.trial.time_s, run.trial.length_change_l0)
        speed = float(high - low) / (0.5 * lasts_s)
    middle, half = 0.5 * (phase.start_s + phase.end_s), 0.5 * _SHARE * lasts_s
    inside = (run.time_s >= middle - half - 5e-10) & (run.time_s <= middle + half + 5e-10)
    if not np.any(inside):
        inside = np.arange(run.time_s.size) == int(np.argmin(np.abs(run.time_s - middle)))
    se = None if run.noise is None else run.noise.of_mean(run.time_s[inside])
    why = "" if before.value is not None else f"isometric force: {before.why}"
    still = _changes(run, phase, inside, se or 0.0)
    if not why and still > _STEADY:
        why = (
            f"force: it still changes at the middle of the ramp (by {100.0 * still:.0f} % in the fifth of the way "
            "before it); a larger --amplitude, or a longer ramp of a recording, gives it time"
        )
    force = Estimate(float(np.mean(run.force_f0[inside])), se)
    assert force.value is not None
    power = Estimate(-speed * force.value, None if se is None else abs(speed) * se)
    row |= {"shortening_l0_per_s": -speed, "force_f0": force, "power_f0_l0_per_s": power}
    return row | {"load": quotient(force, before)}, why


def _changes(run: Run, ramp: Phase, middle: Bools, se_f0: float) -> float:
    """How much force changes, beyond noise, from 0.4 of the ramp to its middle, as a share of that there."""
    at_s = ramp.start_s + 0.4 * (ramp.end_s - ramp.start_s)
    half_s = 0.5 * _SHARE * (ramp.end_s - ramp.start_s)
    earlier = np.abs(run.time_s - at_s) <= half_s + 5e-10
    if not np.any(earlier):
        return 0.0
    force = float(np.mean(run.force_f0[middle]))
    apart = abs(float(np.mean(run.force_f0[earlier])) - force) - 3.0 * np.sqrt(2.0) * se_f0
    return float(max(apart, 0.0) / max(abs(force), 1e-6))
