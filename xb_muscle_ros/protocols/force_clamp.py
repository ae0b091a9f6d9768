"""Force clamps (isotonic): velocity, force-velocity and power curves of loads below and above the isometric force."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from xb_muscle_ros.errors import StateViolation, UserError, naming
from xb_muscle_ros.models.clamping import clamp_run
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.protocols import force_velocity_curve as curve
from xb_muscle_ros.protocols.base import Cell, Column, Found, NoAnswer, Option, Planned, Protocol, Run, Settings, run_of
from xb_muscle_ros.protocols.inputs import facts_of, pca_option, planned_between, rate_option
from xb_muscle_ros.scores.clamp import ClampWindow, clamp_window, velocity
from xb_muscle_ros.scores.estimate import Estimate, Missing
from xb_muscle_ros.scores.readout import isometric_force
from xb_muscle_ros.simulation.offline import as_simulated, calcium_per_step
from xb_muscle_ros.trials.protocol import ALLOWED, Allowed
from xb_muscle_ros.trials.simulated import Simulated
from xb_muscle_ros.trials.stamps import to_ns
from xb_muscle_ros.trials.trial import Array, Trial

CLAMP = "clamp"
# Length that changes by less stays as it is, L0.
_MOVED_L0 = 2e-3


class ForceClamps(Protocol):
    """One load in each trial."""

    name = "force-clamp"
    title = "constant loads: velocity of shortening, force-velocity and power curves"
    options = (
        pca_option(4.5),
        Option(
            "load", (0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9), Allowed(0.0, 3.0, "F/F_isometric"),
            "over the isometric force of the same trial",
        ),
        Option("hold", (0.15,), Allowed(0.001, 60.0, "s"), "how long the load is held, s", many=False),
        Option("begin", (0.05,), ALLOWED["lead_s"], "velocity is read from so long after the load on, s", many=False),
        Option("window", (0.05,), Allowed(0.001, 60.0, "s"), "for how long it is read, s", many=False),
        Option("lead", (0.1,), ALLOWED["lead_s"], "isometric time before, s", many=False),
        rate_option(5000.0),
    )  # fmt: skip
    columns: Mapping[str, Column] = {
        **curve.OF_TRIAL,
        "load": Column("load", "isometric force", ".4f"),
        "held_within_f0": Column("load held within", "F0", ".1e"),
        "shortening_l0_per_s": Column("velocity of shortening", "L0/s", ".4f"),
        **curve.POWER,
        "read_from_s": Column("read from", "s", ".4g"),
        "read_to_s": Column("to", "s", ".4g"),
    }
    numbers = curve.NUMBERS
    source = "Hill 1938"

    def plan(self, fibre: str, settings: Settings) -> list[Planned]:
        """One trial for each pCa and load; its length is that of the rest until a model answers.

        Raises:
            UserError: velocity would be read beyond the load.
        """
        hold, begin, window, lead, rate = (settings[k][0] for k in ("hold", "begin", "window", "lead", "rate"))
        if begin + window > hold * (1.0 + 1e-9):
            raise UserError(
                f"--begin {begin:g} and --window {window:g} s go on beyond the load, which is held for {hold:g} s; "
                "take less of either, or a longer --hold"
            )
        planned = []
        for pca, load in itertools.product(settings["pca"], settings["load"]):
            told = {"pca": pca, "load": load, "begin_s": begin, "window_s": window}
            facts = facts_of(self.name, fibre, f"clamp_load{1e3 * load:g}_pca{10.0 * pca:g}", told)
            made = planned_between(facts, [("isometric", lead, 0.0), (CLAMP, hold, 0.0)], pca, rate)
            clamped = made.trial.time_s > made.trial.phases_by_name()[CLAMP].start_s + 5e-10
            planned.append(Planned(made.trial, load=np.where(clamped, load, 1.0)))
        return planned

    def answer(self, muscle: Muscle, planned: Planned, settle_s: float | None = None) -> Run:
        """The length at which the fibre bears the load, solved for in the compiled step."""
        load = planned.trial.facts.setting("load")
        assert load is not None  # planned above
        phase = planned.trial.phases_by_name()[CLAMP]
        return _under_load(muscle, planned.trial, (phase.start_s, None), phase.start_s, load, settle_s)

    def answered(self, planned: Planned, simulated: Simulated, length_m: Array | None = None) -> Run:
        """The load in F0 is told beside its share."""
        run = super().answered(planned, simulated, length_m)
        return replace(run, trial=_with_load(run.trial, float(planned.load[-1] * run.force_f0[0])))

    def repeat(self, muscle: Muscle, trial: Trial, settle_s: float | None = None) -> Run:
        """The recorded length up to the clamp, then the recorded load, as a share of the recorded isometric force."""
        found = _window(Run(trial, trial.force_time_s, trial.measured_f0))
        before = isometric_force(trial, trial.force_time_s, trial.measured_f0)
        if isinstance(found, Missing) or not before.value:
            why = found.why if isinstance(found, Missing) else before.why or "force before the clamp is zero"
            raise NoAnswer(f"trial {trial.facts.trial}: {why}, so the model has no load to bear")
        moves_s = _still_until(trial)
        return _under_load(muscle, trial, (found.start_s, found.end_s), moves_s, found.load_f0 / before.value, settle_s)

    def analyse(self, fibre: str, of: str, runs: Sequence[Run]) -> Found:
        """Velocity in the window of each trial, and Hill's hyperbola through them."""
        rows: list[Mapping[str, Cell]] = []
        told: list[tuple[str, str]] = []
        for run in runs:
            row, whys = _row(run)
            rows.append(row)
            told += [(run.trial.facts.trial, why) for why in whys]
        return curve.found_of(fibre, of, runs, rows, told, True)

    def draw(self, figure: Any, found: Sequence[Found]) -> None:
        """Length against time, velocity and power against load."""
        curve.draw(figure, found, "length")

    def size_mm(self, found: Sequence[Found]) -> tuple[float, float]:
        """Three axes beside each other."""
        return curve.SIZE_MM


def _still_until(trial: Trial) -> float:
    """When length first moves: a quick release may bring the muscle to its load, and force is isometric before it."""
    moved = np.flatnonzero(np.abs(trial.length_change_l0 - trial.length_change_l0[0]) > _MOVED_L0)
    return float(trial.time_s[max(int(moved[0]) - 1, 0)]) if moved.size else float(trial.time_s[-1])


def _under_load(
    muscle: Muscle,
    trial: Trial,
    between_s: tuple[float, float | None],
    isometric_s: float,
    load: float,
    settle_s: float | None,
) -> Run:
    """A trial whose length follows from a load from one time on; the rest of a record after the load is left out.

    Args:
        between_s: begin and end of the load, s; None for the end of the trial.
        isometric_s: when, at the latest, the model's force is the isometric one, s.
        load: over that force.

    Raises:
        NoAnswer: there is no length at which the fibre bears the load; names the trial.
        UserError, StateViolation: see `Muscle.run`; names the trial.
    """
    start_s, end_s = between_s
    last = trial.time_s.size if end_s is None else int(np.searchsorted(trial.time_s, end_s + 5e-10, side="right"))
    # The last sample before the load.
    k = max(int(np.searchsorted(trial.time_s, start_s + 5e-10, side="right")) - 1, 0)
    calcium, dt_s = calcium_per_step(trial)[:last], np.diff(to_ns(trial.time_s[:last])) / 1e9
    length = trial.length_change_l0[:last]
    with naming(f"trial {trial.facts.trial}"):
        state = muscle.settle(float(length[0]), float(calcium[0]), settle_s)
        before = muscle.run(state, dt_s[:k], length[: k + 1], calcium[: k + 1])
        still = min(int(np.searchsorted(trial.time_s, isometric_s + 5e-10, side="right")) - 1, k)
        level = load * muscle.outputs(before[still]).force_f0
        try:
            after = clamp_run(muscle, before[-1], dt_s[k:], np.full(last - k, level), calcium[k:])
        except StateViolation:
            raise
        except UserError as problem:
            raise NoAnswer(str(problem)) from problem
    states = np.concatenate([before[:-1], after])
    trial = _with_load(trial, level)
    held = trial.calcium_time_s <= trial.time_s[last - 1]
    given = replace(
        trial,
        time_s=trial.time_s[:last],
        length_m=trial.facts.reference_length_m * (1.0 + states[:, -3]),
        calcium_time_s=trial.calcium_time_s[held],
        calcium_um=trial.calcium_um[held],
        force_time_s=np.empty(0),
        force_n=np.empty(0),
    )
    return run_of(given, as_simulated(given, given.time_s, muscle.outputs_of(states)))


def _with_load(trial: Trial, load_f0: float) -> Trial:
    """A planned trial that tells its load in F0; a recording as it is."""
    facts = trial.facts
    if facts.setting("load") is None:
        return trial
    return replace(trial, facts=replace(facts, settings=(*facts.settings, ("load_f0", load_f0))))


def _window(run: Run) -> ClampWindow | Missing:
    """The clamp that the trial tells of, or that its force shows."""
    phase = run.trial.phases_by_name().get(CLAMP)
    known = None if phase is None else (phase.start_s, phase.end_s)
    return clamp_window(run.time_s, run.force_f0, run.length_l0, known)


def _row(run: Run) -> tuple[Mapping[str, Cell], list[str]]:
    """A row, and what there is to say of it."""
    facts = run.trial.facts
    before = isometric_force(run.trial, run.time_s, run.force_f0, run.noise)
    row: dict[str, Cell] = {"trial": facts.trial, "pca": facts.pca, "isometric_f0": before}
    found = _window(run)
    if before.value is None or isinstance(found, Missing):
        return row, [f"clamp: {found.why if isinstance(found, Missing) else before.why}"]
    told = [f"clamp: found from force, {found.start_s:.4g} to {found.end_s:.4g} s"] if found.guessed else []
    begin_s, window_s = run.setting("begin_s"), run.setting("window_s")
    if begin_s is None or window_s is None:
        # The middle third: the springs have given way, and the load is not yet over.
        third = (found.end_s - found.start_s) / 3.0
        begin_s, window_s = third, third
        told.append("velocity: read in the middle third of the clamp")
    begin_s += found.start_s
    end_s = min(begin_s + window_s, found.end_s)
    speed = velocity(run.time_s, run.length_l0, begin_s, end_s)
    row |= {"load": found.load_f0 / before.value, "held_within_f0": found.held_within_f0}
    row |= {"read_from_s": begin_s, "read_to_s": end_s}
    if isinstance(speed, Missing):
        return row, [*told, f"velocity: {speed.why}"]
    noisy = run.simulated is None
    shortening = Estimate(-speed.value, speed.se if noisy else None)
    power = Estimate(-speed.value * found.load_f0, None if not noisy else abs(found.load_f0) * speed.se)
    return row | {"shortening_l0_per_s": shortening, "power_f0_l0_per_s": power}, told
