"""Work loops (Josephson 1985): cycles of length with activation in each, net work and power."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.protocols.base import (
    MEASURED,
    Cell,
    Column,
    Curve,
    Found,
    Number,
    Option,
    Planned,
    Protocol,
    Run,
    Settings,
)
from xb_muscle_ros.protocols.calcium import pulse_train, transient_of, transient_options
from xb_muscle_ros.protocols.inputs import calcium_um, facts_of, rate_option
from xb_muscle_ros.protocols.stimulation import stimulated
from xb_muscle_ros.protocols.work_loop_figure import draw
from xb_muscle_ros.scores.cycles import oscillations
from xb_muscle_ros.scores.estimate import Estimate, rounded
from xb_muscle_ros.scores.standard_error import NO_NOISE_KNOWN, noise_outside
from xb_muscle_ros.scores.work_loop import Work, repeats_from, work_of
from xb_muscle_ros.trials.protocol import Allowed
from xb_muscle_ros.trials.trial import Array, Phase

CYCLES = "cycles"
_LEAD_S = 0.1
# Net work may differ by this share of the work turned over where loops repeat.
_SAME = 0.01
# Fewer samples to a cycle change net work by more than 2 %; for recordings it is said where they change it by 0.4 %.
_LEAST_SAMPLES, _TOLD_SAMPLES = 20.0, 40.0
_OF_CYCLE: Mapping[str, Column] = {
    "net_f0_l0": Column("net work", "10⁻³ F0·L0", ".3f", 1e3),
    "shortening_f0_l0": Column("shortening work", "10⁻³ F0·L0", ".3f", 1e3),
    "lengthening_f0_l0": Column("lengthening work", "10⁻³ F0·L0", ".3f", 1e3),
    "power_f0_l0_per_s": Column("power", "10⁻³ F0·L0/s", ".3f", 1e3),
    "power_w_per_l": Column("power", "W/L", ".3g"),
    "peak_f0": Column("peak force", "F0", ".3f"),
    "mean_f0": Column("mean force", "F0", ".3f"),
}


class WorkLoops(Protocol):
    """One trial for each combination of frequency, amplitude, phase, duty and pCa of the bath."""

    name = "work-loop"
    title = "cycles of length with activation in each: net work, power and peak force"
    options = (
        Option("frequency", (0.5, 1.0, 2.0, 3.0, 5.0), Allowed(0.01, 1000.0, "Hz"), "of the cycles of length, Hz"),
        Option("amplitude", (0.05,), Allowed(0.0, 0.25, "L0", True, ": amplitudes are in L0, {percent}"),
               "of the sinusoid about its middle, L0"),
        Option("phase", (-0.1,), Allowed(-1.0, 1.0, ""),
               "begin of stimulation after the longest length, as a share of the cycle (negative: before)"),
        Option("duty", (0.4,), Allowed(0.0, 1.0, ""), "share of the cycle that is stimulated; 0: one pulse"),
        Option("pulse-rate", (100.0,), Allowed(0.1, 2000.0, "1/s"), "of pulses while stimulated, 1/s", many=False),
        *transient_options(),
        Option("bath-pca", (0.0,), Allowed(0.0, 12.0, ""), "pCa all the time, without stimulation; 0: stimulated"),
        Option("cycles", (6.0,), Allowed(2.0, 10_000.0, ""), "of length", many=False),
        Option("stress", (0.0,), Allowed(0.0, 2000.0, "kPa"), "F0 over cross-section, kPa; 0: not known", many=False),
        rate_option(2000.0),
    )  # fmt: skip
    columns: Mapping[str, Column] = {
        "trial": Column("trial"),
        "pca": Column("pCa", form="g"),
        "frequency_hz": Column("frequency", "Hz", ".4g"),
        "amplitude_l0": Column("amplitude", "% L0", ".3g", 100.0),
        "phase": Column("phase", "", "g"),
        "duty": Column("duty", "", "g"),
        "cycles": Column("cycles", "", ".0f"),
        "repeats_from": Column("repeats from cycle", "", ".0f"),
        **_OF_CYCLE,
        "first_net_f0_l0": Column("net work, first cycle", "10⁻³ F0·L0", ".3f", 1e3),
    }
    numbers: Mapping[str, Column] = {
        "power_f0_l0_per_s": Column("largest power", "10⁻³ F0·L0/s", ".3f", 1e3),
        "frequency_hz": Column("at frequency", "Hz", ".4g"),
    }
    part = "cycle"
    part_columns: Mapping[str, Column] = {
        "trial": Column("trial"),
        "cycle": Column("cycle", "", ".0f"),
        "start_s": Column("begin", "s", ".4g"),
        "end_s": Column("end", "s", ".4g"),
        **_OF_CYCLE,
    }
    source = "Josephson 1985, J Exp Biol 114: 493-512"

    def plan(self, fibre: str, settings: Settings) -> list[Planned]:
        """One trial for each combination; phase and duty do not matter for a bath of constant calcium.

        Raises:
            UserError: see `transient_of` and `stimulated`; samples are too few for a cycle, or cycles are not whole.
        """
        transient, rate, count = transient_of(settings), settings["rate"][0], round(settings["cycles"][0])
        if abs(settings["cycles"][0] - count) > 1e-9:
            raise UserError(f"--cycles is {settings['cycles'][0]:g}; needed is a whole number, for example {count}")
        baths = settings["bath-pca"]
        stimuli = list(itertools.product([None], settings["phase"], settings["duty"])) if 0.0 in baths else []
        given = [*stimuli, *((pca, None, None) for pca in baths if pca > 0.0)]
        made = []
        for frequency, amplitude, (bath, phase, duty) in itertools.product(
            settings["frequency"], settings["amplitude"], given
        ):
            if rate < _LEAST_SAMPLES * frequency * (1.0 - 1e-9):
                raise UserError(
                    f"--rate is {rate:g} samples per second, {rate / frequency:.3g} for each cycle of {frequency:g} "
                    f"Hz; needed are {_LEAST_SAMPLES:g}: take a rate of {_LEAST_SAMPLES * frequency:g} or more"
                )
            end_s = _LEAD_S + count / frequency
            told = {"frequency_hz": frequency, "amplitude_l0": amplitude, "stress_kpa": settings["stress"][0]}
            name = f"work_loop_{frequency:g}hz_amp{1e4 * amplitude:g}"
            pulses: list[float] = []
            if bath is None:
                assert phase is not None
                assert duty is not None
                told |= {"phase": phase, "duty": duty}
                name += f"_phase{1e2 * phase:g}_duty{1e2 * duty:g}"
                for k in range(-1, count + 1):
                    # The longest length of cycle k is a quarter of it after its begin.
                    begin_s = _LEAD_S + (k + 0.25 + phase) / frequency
                    pulses += pulse_train(begin_s, duty / frequency, settings["pulse-rate"][0])
                pulses = [pulse for pulse in pulses if _LEAD_S <= pulse < end_s]
            else:
                name += f"_pca{10.0 * bath:g}"
            trial = stimulated(facts_of(self.name, fibre, name, told), transient, pulses, end_s, rate).trial
            since_s = np.maximum(trial.time_s - _LEAD_S, 0.0)
            phases = (Phase("isometric", 0.0, _LEAD_S), Phase(CYCLES, _LEAD_S, end_s))
            trial = replace(
                trial,
                facts=replace(trial.facts, pca=bath, phases=phases),
                length_m=1.0 + amplitude * np.sin(2.0 * np.pi * frequency * since_s),
            )
            if bath is not None:
                trial = replace(trial, calcium_time_s=np.zeros(1), calcium_um=np.array([calcium_um(bath)]))
            made.append(Planned(trial))
        return made

    def analyse(self, fibre: str, of: str, runs: Sequence[Run]) -> Found:
        """Work of every cycle; the table of trials has that of the last of each."""
        rows: list[Mapping[str, Cell]] = []
        parts: list[Mapping[str, Cell]] = []
        notes: list[str] = []
        curves: dict[str, Curve] = {}
        unknown = 0
        for run in runs:
            name = run.trial.facts.trial
            found, told = _cycles(run)
            notes += [f"trial {name}: {line}" for line in told]
            # Within cycles and between them force only moves.
            moving = [(float(found[0][0]), float(found[-1][-1]))] if found else []
            for edges in found:
                noise = None if run.simulated is not None else noise_outside(run.trial, moving)
                works = [
                    work_of(run.time_s, run.length_l0, run.force_f0, begin, end, noise)
                    for begin, end in itertools.pairwise(edges)
                ]
                rows.append({"trial": name, **_row(run, edges, works)})
                parts += [
                    {"trial": name, "cycle": k, "start_s": begin, "end_s": end, **_of_cycle(run, end - begin, work)}
                    for k, ((begin, end), work) in enumerate(
                        zip(itertools.pairwise(edges.tolist()), works, strict=True), 1
                    )
                ]
                unknown += noise is None
                curves[f"net work {len(rows)}"] = Curve(
                    np.arange(1.0, len(works) + 1.0), np.array([work.net.value for work in works], dtype=float)
                )
                cycle = slice(*np.searchsorted(run.time_s, edges[-2:] + np.array([-1e-9, 1e-9])).tolist())
                curves[f"loop {len(rows)}"] = Curve(run.length_l0[cycle], run.force_f0[cycle])
                notes += [f"trial {name}: {line}" for line in (*_remarks(works), *_coarse(run, edges))]
        if of == MEASURED and unknown:
            notes.append(f"{NO_NOISE_KNOWN} ({unknown} of {len(rows)})")
        return Found(fibre, of, tuple(rows), _numbers(rows), curves, tuple(runs), tuple(notes), parts=tuple(parts))

    def size_mm(self, found: Sequence[Found]) -> tuple[float, float]:
        """Wide enough for three panels."""
        return 180.0, 70.0

    def draw(self, figure: Any, found: Sequence[Found]) -> None:
        """Last loop of each trial with its direction, power against what varies, net work from cycle to cycle."""
        draw(figure, found)


def _cycles(run: Run) -> tuple[list[Array], list[str]]:
    """Begins of cycles, and end of the last (s), of each series of cycles; and what is said about it."""
    trial = run.trial
    frequency, phase = run.setting("frequency_hz"), trial.phases_by_name().get(CYCLES)
    if trial.facts.protocol == WorkLoops.name and frequency is not None and phase is not None:
        count = round((phase.end_s - phase.start_s) * frequency)
        return [phase.start_s + np.arange(count + 1) / frequency], []
    seen = oscillations(trial.time_s, trial.length_change_l0)
    if not seen:
        return [], ["length does not go through two cycles or more"]
    told = [
        f"{one.cycles} cycles of {_frequency(one.start_s):.4g} Hz from {one.start_s[0]:.4g} to {one.start_s[-1]:.4g} s"
        for one in seen
    ]
    return [one.start_s for one in seen], [f"found from length: {'; '.join(told)}"]


def _frequency(edges: Array) -> float:
    return float(f"{(edges.size - 1) / (edges[-1] - edges[0]):.9g}")


def _row(run: Run, edges: Array, works: list[Work]) -> Mapping[str, Cell]:
    return {
        "pca": run.trial.facts.pca,
        "frequency_hz": _frequency(edges),
        "amplitude_l0": 0.5 * works[-1].excursion_l0,
        "phase": run.setting("phase"),
        "duty": run.setting("duty"),
        "cycles": float(len(works)),
        "repeats_from": repeats_from(works, _SAME),
        **_of_cycle(run, float(edges[-1] - edges[-2]), works[-1]),
        "first_net_f0_l0": works[0].net,
    }


def _of_cycle(run: Run, duration_s: float, work: Work) -> Mapping[str, Cell]:
    stress, power = run.setting("stress_kpa") or None, _times(work.net, 1.0 / duration_s)
    return {
        "net_f0_l0": work.net,
        "shortening_f0_l0": work.shortening,
        "lengthening_f0_l0": work.lengthening,
        "power_f0_l0_per_s": power,
        # 1 kPa is 1 kJ/m³, that is 1 J/L.
        "power_w_per_l": None if stress is None else _times(power, stress),
        "peak_f0": work.peak_f0,
        "mean_f0": work.mean_f0,
    }


def _times(one: Estimate, by: float) -> Estimate:
    return Estimate(None if one.value is None else by * one.value, None if one.se is None else rounded(by * one.se))


def _remarks(works: list[Work]) -> list[str]:
    last = works[-1]
    lines = []
    if repeats_from(works, _SAME) is None:
        lines.append(f"loops do not repeat within {100.0 * _SAME:g} % after {len(works)} cycles; take more cycles")
    if abs(last.left_l0) > _SAME * last.excursion_l0:
        lines.append(f"the last loop does not close: length ends {100.0 * last.left_l0:.3g} % L0 from where it began")
    return lines


def _coarse(run: Run, edges: Array) -> list[str]:
    """What few samples to a cycle do to net work, which is that of straight lines between them."""
    names = ("length", "force") if run.simulated is None else ("force",)
    times = {"length": run.trial.time_s, "force": run.time_s}
    counts = {name: np.ptp(np.searchsorted(times[name], edges[[0, -1]])) / (edges.size - 1) for name in names}
    name = min(names, key=lambda each: float(counts[each]))
    count = float(counts[name])
    if count >= _TOLD_SAMPLES * (1.0 - 1e-6):
        return []
    angle = 2.0 * np.pi / count
    lost = 100.0 * (1.0 - np.sin(angle) / angle) if angle < np.pi else 100.0
    return [
        f"{count:.3g} samples of {name} to a cycle: net work is that of straight lines between them, up to {lost:.2g} "
        f"% too small where length and force are sinusoids; {_TOLD_SAMPLES:g} make it less than half a percent"
    ]


def _numbers(rows: Sequence[Mapping[str, Cell]]) -> Mapping[str, Number]:
    """Largest power and where it is."""
    best, most = None, -np.inf
    for row in rows:
        power = row["power_f0_l0_per_s"]
        if isinstance(power, Estimate) and power.value is not None and power.value > most:
            best, most = row, power.value
    if best is None:
        return {key: Number(None, why="no cycles") for key in WorkLoops.numbers}
    power, frequency = best["power_f0_l0_per_s"], best["frequency_hz"]
    assert isinstance(power, Estimate)
    return {
        "power_f0_l0_per_s": Number(power.value, power.se, why="largest of the trials"),
        "frequency_hz": Number(frequency if isinstance(frequency, float) else None),
    }
