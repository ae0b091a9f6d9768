"""Trains of pulses: force and fusion against the frequency of stimulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from xb_muscle_ros.protocols.base import Cell, Column, Found, Number, Option, Planned, Protocol, Run, Settings
from xb_muscle_ros.protocols.calcium import pulse_train, transient_of, transient_options
from xb_muscle_ros.protocols.figures import legend, lettered, logarithmic, looks, plainly
from xb_muscle_ros.protocols.inputs import facts_of, rate_option
from xb_muscle_ros.protocols.stimulation import begun_s, stimulated
from xb_muscle_ros.scores.estimate import Missing, notes_of
from xb_muscle_ros.scores.standard_error import noise_between
from xb_muscle_ros.scores.twitch import largest, level_before, ripple
from xb_muscle_ros.trials.protocol import ALLOWED, Allowed

_LEAD_S, _AFTER_S = 0.05, 0.5
# Fused, by the fusion index of Celichowski and Grottel 1995.
_FUSED = 0.9


class Tetani(Protocol):
    """One train of pulses at each frequency."""

    name = "tetanus"
    title = "trains of pulses at fixed length: force and fusion against frequency"
    options = (
        Option(
            "frequency", (1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 80.0, 120.0), Allowed(0.1, 1000.0, "1/s"),
            "of the pulses",
        ),
        *transient_options(),
        Option("duration", (1.5,), ALLOWED["hold_s"], "of the train, at least two pulses, s", many=False),
        rate_option(5000.0),
    )  # fmt: skip
    columns: Mapping[str, Column] = {
        "trial": Column("trial"),
        "frequency_hz": Column("frequency", "1/s", "g"),
        "rest_f0": Column("force at rest", "F0", ".4f"),
        "peak_f0": Column("last peak above rest", "F0", ".4f"),
        "fusion": Column("fusion index", "", ".3f"),
    }
    numbers: Mapping[str, Column] = {
        "largest_f0": Column("largest force above rest", "F0", ".3f"),
        "half_hz": Column("frequency of half of it", "1/s", ".2f"),
        "fused_hz": Column(f"frequency of fusion index {_FUSED:g}", "1/s", ".2f"),
    }
    source = "fusion index: Celichowski and Grottel 1995; transient: Baylor and Hollingworth 2003"

    def plan(self, fibre: str, settings: Settings) -> list[Planned]:
        """One trial for each frequency.

        Raises:
            UserError: see `transient_of`.
        """
        transient, rate = transient_of(settings), settings["rate"][0]
        own = ("rate", "duration", "frequency")
        told = {key.replace("-", "_"): values[0] for key, values in settings.items() if key not in own}
        planned = []
        for frequency in settings["frequency"]:
            pulses = pulse_train(_LEAD_S, max(settings["duration"][0], 1.5 / frequency), frequency)
            of_trial = {"frequency_hz": frequency, "first_pulse_s": pulses[0], "last_pulse_s": pulses[-1], **told}
            facts = facts_of(self.name, fibre, f"tetanus_{frequency:g}hz", of_trial)
            planned.append(stimulated(facts, transient, pulses, pulses[-1] + max(_AFTER_S, 2.0 / frequency), rate))
        return planned

    def analyse(self, fibre: str, of: str, runs: Sequence[Run]) -> Found:
        """Force and fusion of the last responses; half force and fusion by lines between the frequencies."""
        rows: list[Mapping[str, Cell]] = []
        notes = []
        for run in runs:
            name, frequency, last_s = run.trial.facts.trial, run.setting("frequency_hz"), run.setting("last_pulse_s")
            first_s, guessed = begun_s(run)
            noise = None if run.simulated is not None else noise_between(run.trial, float(run.time_s[0]), first_s)
            rest = level_before(run.time_s, run.force_f0, first_s, noise)
            assert rest.value is not None
            row: dict[str, Cell] = {"trial": name, "frequency_hz": frequency, "rest_f0": rest}
            if frequency is None or last_s is None:
                notes += [(name, f"pulse: {guessed}"), (name, "fusion: the trial does not tell its pulses")]
                rows.append(row | {"peak_f0": largest(run.time_s, run.force_f0, rest.value, noise)})
                continue
            found = ripple(run.time_s, run.force_f0, rest.value, (last_s - 1.0 / frequency, last_s), noise)
            if isinstance(found, Missing):
                notes.append((name, f"fusion: {found.why}"))
            rows.append(row if isinstance(found, Missing) else row | found._asdict())
        found_all = Found(fibre, of, tuple(rows), runs=tuple(runs), notes=tuple(notes_of(notes)))
        return Found(fibre, of, found_all.rows, _numbers(found_all), {}, found_all.runs, found_all.notes)

    def draw(self, figure: Any, found: Sequence[Found]) -> None:
        """Force against time, and force and fusion against frequency."""
        traces, force, fusion = figure.subplots(1, 3, width_ratios=(1.4, 1.0, 1.0))
        for look, each in looks(found):
            for run in each.runs:
                traces.plot(run.time_s - begun_s(run)[0], run.force_f0, **{**look.trace, "linewidth": 0.6})
            frequency = each.column("frequency_hz")
            # Markers at the end of an axis are whole.
            force.plot(frequency, each.column("peak_f0"), **look.points, clip_on=False, zorder=3)
            fusion.plot(frequency, each.column("fusion"), **look.points, clip_on=False, zorder=3)
        fusion.axhline(_FUSED, color="black", linewidth=0.6, linestyle=":")
        traces.set(xlabel="time after the first pulse (s)", ylabel="force (F$_0$)")
        for axis, text in ((force, "last peak above rest (F$_0$)"), (fusion, "fusion index")):
            axis.set(xlabel="frequency of stimulation (1/s)", ylabel=text)
            logarithmic(axis)
            if axis.get_xscale() == "log":
                plainly(axis.xaxis)
            axis.set_ylim(bottom=0.0)
        legend(force)
        lettered([traces, force, fusion])

    def size_mm(self, found: Sequence[Found]) -> tuple[float, float]:
        """Three axes beside each other."""
        return 190.0, 70.0


def _numbers(found: Found) -> dict[str, Number]:
    frequency, peak, fusion = (found.column(key) for key in ("frequency_hz", "peak_f0", "fusion"))
    known = np.isfinite(frequency) & np.isfinite(peak)
    if not np.any(known):
        return {}
    order = np.argsort(frequency[known])
    frequency, peak, fusion = (values[known][order] for values in (frequency, peak, fusion))
    largest = float(np.max(peak))
    return {
        "largest_f0": Number(largest),
        "half_hz": _crossing(frequency, peak, 0.5 * largest),
        "fused_hz": _crossing(frequency, fusion, _FUSED),
    }


def _crossing(x: Any, y: Any, level: float) -> Number:
    """Where y first rises through a level, on a logarithmic x; none where it does not between the points."""
    over = np.flatnonzero(y >= level)
    if not over.size or over[0] == 0 or not np.isfinite(y[over[0] - 1]):
        return Number(None, why="it lies beyond the frequencies")
    k = int(over[0])
    share = (level - y[k - 1]) / (y[k] - y[k - 1])
    return Number(float(np.exp(np.log(x[k - 1]) + share * np.log(x[k] / x[k - 1]))))
