"""Isometric twitches: one pulse, and the times of the force that follows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from xb_muscle_ros.protocols.base import MEASURED, Cell, Column, Found, Option, Planned, Protocol, Run, Settings
from xb_muscle_ros.protocols.calcium import transient_of, transient_options
from xb_muscle_ros.protocols.figures import legend, lettered, looks
from xb_muscle_ros.protocols.inputs import facts_of, rate_option
from xb_muscle_ros.protocols.stimulation import begun_s, stimulated
from xb_muscle_ros.scores.estimate import Estimate, Missing, notes_of
from xb_muscle_ros.scores.standard_error import NO_NOISE_KNOWN, noise_between
from xb_muscle_ros.scores.twitch import twitch
from xb_muscle_ros.trials.protocol import ALLOWED

# The pulse comes after this, s.
_LEAD_S = 0.05


class Twitches(Protocol):
    """One isometric contraction."""

    name = "twitch"
    title = "one pulse at fixed length: peak force, time to peak, half relaxation"
    options = (
        *transient_options(),
        Option("duration", (1.0,), ALLOWED["hold_s"], "of the trial after the pulse, s", many=False),
        rate_option(5000.0),
    )
    columns: Mapping[str, Column] = {
        "trial": Column("trial"),
        "rest_f0": Column("force at rest", "F0", ".4f"),
        "peak_f0": Column("peak above rest", "F0", ".4f"),
        "to_peak_s": Column("time to peak", "ms", ".1f", 1e3),
        "half_relaxation_s": Column("half relaxation", "ms", ".1f", 1e3),
        "rise_per_s": Column("steepest rise", "peaks/s", ".3g"),
        "fall_per_s": Column("steepest fall", "peaks/s", ".3g"),
    }
    source = "transient: Baylor and Hollingworth 2003"

    def plan(self, fibre: str, settings: Settings) -> list[Planned]:
        """One trial.

        Raises:
            UserError: see `transient_of`.
        """
        told = {key.replace("-", "_"): values[0] for key, values in settings.items() if key not in ("rate", "duration")}
        facts = facts_of(self.name, fibre, "twitch", {"first_pulse_s": _LEAD_S, **told})
        duration = _LEAD_S + settings["duration"][0]
        return [stimulated(facts, transient_of(settings), [_LEAD_S], duration, settings["rate"][0])]

    def analyse(self, fibre: str, of: str, runs: Sequence[Run]) -> Found:
        """Times of each contraction."""
        rows: list[Mapping[str, Cell]] = []
        notes, unknown = [], 0
        for run in runs:
            name = run.trial.facts.trial
            pulse_s, guessed = begun_s(run)
            notes += [(name, f"pulse: {guessed}")] if guessed else []
            noise = None if run.simulated is not None else noise_between(run.trial, float(run.time_s[0]), pulse_s)
            found = twitch(run.time_s, run.force_f0, pulse_s, noise)
            if isinstance(found, Missing):
                rows.append({"trial": name})
                notes.append((name, f"twitch: {found.why}"))
                continue
            rows.append({"trial": name, **found._asdict()})
            lacking = dict.fromkeys(each.why for each in found if each.value is None)
            if found.peak_f0.value is None:
                notes += [(name, f"twitch: {why}") for why in lacking]
            elif found.half_relaxation_s.value is None:
                notes.append((name, f"half relaxation: {found.half_relaxation_s.why}"))
            unknown += of == MEASURED and noise is None
        lines = notes_of(notes) + ([f"{NO_NOISE_KNOWN} ({unknown} of {len(rows)})"] if unknown else [])
        return Found(fibre, of, tuple(rows), runs=tuple(runs), notes=tuple(lines))

    def draw(self, figure: Any, found: Sequence[Found]) -> None:
        """Calcium and force against time, and force over its peak."""
        calcium, force, relative = figure.subplots(1, 3)
        for look, each in looks(found):
            for run, row in zip(each.runs, each.rows, strict=True):
                since_ms = 1e3 * (run.time_s - begun_s(run)[0])
                calcium.plot(
                    1e3 * (run.trial.calcium_time_s - begun_s(run)[0]),
                    run.trial.calcium_um,
                    color="black",
                    linewidth=0.8,
                )
                force.plot(since_ms, run.force_f0, **look.trace)
                peak, rest = row.get("peak_f0"), row.get("rest_f0")
                if isinstance(peak, Estimate) and isinstance(rest, Estimate) and peak.value and rest.value is not None:
                    relative.plot(since_ms, (run.force_f0 - rest.value) / peak.value, **look.trace)
        calcium.set_ylabel("free calcium (µM)")
        force.set_ylabel("force (F$_0$)")
        relative.set_ylabel("force above rest over its peak")
        for axis in (calcium, force, relative):
            axis.set_xlabel("time after the pulse (ms)")
        legend(force)
        lettered([calcium, force, relative])

    def size_mm(self, found: Sequence[Found]) -> tuple[float, float]:
        """Three axes beside each other."""
        return 190.0, 70.0
