"""Sinusoidal analysis (Kawai & Brandt 1980): complex stiffness against frequency, and the processes in it."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.protocols.base import Cell, Column, Curve, Found, Number, Option, Planned, Protocol, Run, Settings
from xb_muscle_ros.protocols.figures import legend, lettered, logarithmic, looks, plainly
from xb_muscle_ros.protocols.inputs import pca_option
from xb_muscle_ros.protocols.oscillating import NAME, oscillating, windows_of, with_corners
from xb_muscle_ros.scores.complex_stiffness import ComplexStiffness, Trace, complex_stiffness
from xb_muscle_ros.scores.estimate import Missing
from xb_muscle_ros.scores.process_rates import Processes, fit_processes
from xb_muscle_ros.trials.protocol import Allowed
from xb_muscle_ros.trials.trial import Trial

FREQUENCIES_HZ = tuple(float(f"{frequency:.4g}") for frequency in np.geomspace(0.1, 250.0, 30))
# Moduli are good to this share of themselves, noise aside: length is a sinusoid to that.
_GOOD_TO = 1e-3
# Samples to a cycle from which on straight lines between them take less than 1 % of an amplitude.
_SMOOTH = 20.0
# A second harmonic of force above this share of the first is told.
_LINEAR = 0.05
_LETTERS = "abc"


class Sinusoid(Protocol):
    """One trial at each frequency and pCa."""

    name = NAME
    title = "small sinusoidal length changes: complex stiffness against frequency, rates of exponential processes"
    options = (
        pca_option(4.5),
        Option("amplitude", (0.00125,), Allowed(0.0, 0.1, "L0", True, ": amplitudes are in L0, {percent}"),
               "of the sinusoid about its middle, L0", many=False),
        Option("frequency", FREQUENCIES_HZ, Allowed(0.001, 10_000.0, "Hz"), "of the sinusoid, Hz"),
        Option("cycles", (3.0,), Allowed(1.0, 10_000.0, ""), "that are read, at least", many=False),
        Option("samples-per-cycle", (25.0,), Allowed(20.0, 10_000.0, ""), "at least", many=False),
    )  # fmt: skip
    columns: Mapping[str, Column] = {
        "trial": Column("trial"),
        "pca": Column("pCa", form="g"),
        "frequency_hz": Column("frequency", "Hz", ".4g"),
        "amplitude_l0": Column("amplitude", "% L0", ".4g", 100.0),
        "elastic_f0_per_l0": Column("elastic modulus", "F0/L0", ".3f"),
        "viscous_f0_per_l0": Column("viscous modulus", "F0/L0", ".3f"),
        "magnitude_f0_per_l0": Column("magnitude", "F0/L0", ".3f"),
        "phase_deg": Column("phase", "°", ".2f"),
        "second_harmonic": Column("second harmonic", "%", ".2g", 100.0),
        "cycles": Column("cycles", "", ".3g"),
    }
    numbers: Mapping[str, Column] = {
        "base_f0_per_l0": Column("H", "F0/L0", ".3g"),
        "rate_a_per_s": Column("2πa", "1/s", ".3g"),
        "magnitude_a_f0_per_l0": Column("A", "F0/L0", ".3g"),
        "rate_b_per_s": Column("2πb", "1/s", ".3g"),
        "magnitude_b_f0_per_l0": Column("B", "F0/L0", ".3g"),
        "rate_c_per_s": Column("2πc", "1/s", ".3g"),
        "magnitude_c_f0_per_l0": Column("C", "F0/L0", ".3g"),
        "rmsd_share": Column("RMSD of the fit", "%", ".2g", 100.0),
    }
    source = "Kawai & Brandt 1980, J Muscle Res Cell Motil 1: 279-303"

    def plan(self, fibre: str, settings: Settings) -> list[Planned]:
        """One trial for each pCa and frequency: isometric, onset, and whole cycles that are read."""
        amplitude, cycles, each = (settings[k][0] for k in ("amplitude", "cycles", "samples-per-cycle"))
        made = []
        for pca, frequency in itertools.product(settings["pca"], sorted(settings["frequency"])):
            made.append(oscillating(fibre, pca, frequency, amplitude, cycles, each))
        return made

    def repeat(self, muscle: Muscle, trial: Trial, settle_s: float | None = None) -> Run:
        """The recorded length by variable steps where calcium stays: a small oscillation needs small errors."""
        if np.ptp(trial.calcium_um) > 0.0:
            return super().repeat(muscle, trial, settle_s)
        return self.answer(muscle, with_corners(trial), settle_s)

    def analyse(self, fibre: str, of: str, runs: Sequence[Run]) -> Found:
        """Complex stiffness of each oscillation, and the processes at each pCa."""
        rows: list[Mapping[str, Cell]] = []
        notes: list[str] = []
        found: list[tuple[float | None, ComplexStiffness]] = []
        for run in runs:
            name, pca = run.trial.facts.trial, run.trial.facts.pca
            windows, told, noise = windows_of(run)
            notes += [f"trial {name}: {line}" for line in told]
            for frequency, begin_s, end_s in windows:
                length, force = (
                    Trace(time_s[inside], value[inside])
                    for time_s, value in (
                        (run.trial.time_s, run.trial.length_change_l0),
                        (run.time_s, run.force_f0),
                    )
                    for inside in [(time_s >= begin_s - 1e-9) & (time_s < end_s - 1e-9)]
                )
                one = complex_stiffness(length, force, frequency, noise, run.simulated is None)
                if isinstance(one, Missing):
                    notes += [line for line in [f"trial {name}: {one.why}"] if line not in notes]
                    continue
                if run.simulated is not None and told:
                    notes += [f"trial {name}: {line}" for line in _straight(length, one)]
                found.append((pca, one))
                rows.append({"trial": name, "pca": pca, **_row(one)})
        notes += _remarks(found, any(run.simulated is None for run in runs))
        made = Found(fibre, of, tuple(rows), runs=tuple(runs))
        return self._with_processes(made, found, notes)

    def _with_processes(
        self, made: Found, found: Sequence[tuple[float | None, ComplexStiffness]], notes: list[str]
    ) -> Found:
        """Processes of each pCa: the numbers are those of the highest calcium."""
        levels = sorted({pca for pca, _ in found}, key=lambda pca: np.inf if pca is None else pca)
        at: dict[str, Mapping[str, Number]] = {}
        curves: dict[str, Curve] = {}
        for level in levels:
            name = _at(level)
            mine = [one for pca, one in found if pca == level]
            frequency, modulus = np.array([one.frequency_hz for one in mine]), np.array([one.value for one in mine])
            fit = fit_processes(frequency, modulus, _errors(mine))
            if isinstance(fit, Missing):
                notes.append(f"{name}: {fit.why}")
                at[name] = {key: Number(None, why=fit.why) for key in self.numbers}
                continue
            at[name] = _numbers(fit, of_noise=_errors(mine) is not None)
            if said := _said(fit):
                notes.append(f"{name}: {said}")
            fine = np.geomspace(frequency.min(), frequency.max(), 400)
            for part, values in (("elastic", fit.at(fine).real), ("viscous", fit.at(fine).imag)):
                curves[f"{part} {name}"] = Curve(fine, values)
        numbers = next(iter(at.values()), {key: Number(None, why="no oscillation") for key in self.numbers})
        return replace(made, numbers=numbers, numbers_at=at, curves=curves, notes=tuple(notes))

    def size_mm(self, found: Sequence[Found]) -> tuple[float, float]:
        """Wide enough for three panels."""
        return 180.0, 70.0

    def draw(self, figure: Any, found: Sequence[Found]) -> None:
        """Nyquist's plot, and Bode's: magnitude and phase against frequency; fitted processes as lines."""
        nyquist, magnitude, phase = figure.subplots(1, 3)
        for look, each in looks(found):
            elastic, viscous = each.column("elastic_f0_per_l0"), each.column("viscous_f0_per_l0")
            frequency = each.column("frequency_hz")
            marks = {**look.points, "markersize": 3.2}
            nyquist.errorbar(
                elastic, viscous, each.errors("viscous_f0_per_l0"), each.errors("elastic_f0_per_l0"), **marks,
                elinewidth=0.6,
            )  # fmt: skip
            magnitude.plot(frequency, each.column("magnitude_f0_per_l0"), **marks)
            phase.plot(frequency, each.column("phase_deg"), **marks)
            for name in each.numbers_at:
                if f"elastic {name}" not in each.curves:
                    continue
                x, real, imaginary = *each.curves[f"elastic {name}"], each.curves[f"viscous {name}"].y
                nyquist.plot(real, imaginary, **look.curve)
                magnitude.plot(x, np.hypot(real, imaginary), **look.curve)
                phase.plot(x, np.degrees(np.arctan2(imaginary, real)), **look.curve)
                if len(each.numbers_at) > 1:
                    top = int(np.argmax(imaginary))
                    nyquist.annotate(name, (real[top], imaginary[top]), (0, 3), textcoords="offset points", ha="center")
        nyquist.axhline(0.0, color="black", linewidth=0.6)
        phase.axhline(0.0, color="black", linewidth=0.6)
        nyquist.set(xlabel="elastic modulus (F$_0$/L$_0$)", ylabel="viscous modulus (F$_0$/L$_0$)", xlim=(0.0, None))
        nyquist.set_aspect("equal", adjustable="box")
        nyquist.margins(y=0.15)
        for axis in (magnitude, phase):
            axis.set_xlabel("frequency (Hz)")
        logarithmic(magnitude, y=True)
        logarithmic(phase)
        magnitude.set_ylabel("magnitude (F$_0$/L$_0$)")
        if magnitude.get_yscale() == "log":
            plainly(magnitude.yaxis)
        phase.set_ylabel("phase of force before length (°)")
        legend(magnitude)
        lettered([nyquist, magnitude, phase])


def _row(one: ComplexStiffness) -> Mapping[str, Cell]:
    return {
        "frequency_hz": one.frequency_hz,
        "amplitude_l0": one.amplitude_l0,
        "elastic_f0_per_l0": one.elastic,
        "viscous_f0_per_l0": one.viscous,
        "magnitude_f0_per_l0": one.magnitude,
        "phase_deg": one.phase_deg,
        "second_harmonic": one.second,
        "cycles": one.cycles,
    }


def _straight(length: Trace, one: ComplexStiffness) -> list[str]:
    """What few samples of a recorded length do to a model, which goes straight from one to the next."""
    count = length.time_s.size / one.cycles
    if count >= _SMOOTH:
        return []
    lost = 100.0 * (1.0 - float(np.sinc(1.0 / count)) ** 2)
    return [
        f"{count:.3g} samples of length to a cycle of {one.frequency_hz:.4g} Hz, and a model's length is straight "
        f"between them: its moduli may be off by {lost:.2g} %"
    ]


def _remarks(found: Sequence[tuple[float | None, ComplexStiffness]], measured: bool) -> list[str]:
    notes = []
    bent = [(pca, one) for pca, one in found if one.second is not None and one.second > _LINEAR + 3.0 * _noisy(one)]
    if bent:
        pca, worst = max(bent, key=lambda each: each[1].second or 0.0)
        notes.append(
            f"force is not linear in length: its second harmonic is above {100.0 * _LINEAR:g} % of the first at "
            f"{len(bent)} of {len(found)} frequencies, at most {100.0 * (worst.second or 0.0):.3g} % at "
            f"{worst.frequency_hz:.4g} Hz, {_at(pca)}; take a smaller amplitude; where that does not help, "
            "force has a kink at this length, as a passive spring that begins to bear has"
        )
    lacking = sum(one.elastic.se is None for _, one in found) if measured else 0
    if lacking:
        notes.append(f"no standard error at {lacking} frequencies: no quiet time to take noise from, under 4 cycles")
    return notes


def _noisy(one: ComplexStiffness) -> float:
    """Noise as a share of force's first harmonic: that of the second is like it."""
    size, se = one.magnitude.value, one.magnitude.se
    return se / size if size and se else 0.0


def _at(pca: float | None) -> str:
    return "pCa not known" if pca is None else f"pCa {pca:g}"


def _errors(found: Sequence[ComplexStiffness]) -> Any:
    """Standard errors as complex numbers, not below what the moduli are good to; None where one is not known."""
    pairs = [(one.elastic.se, one.viscous.se) for one in found]
    if any(not real or not imaginary for real, imaginary in pairs):
        return None
    sizes = [_GOOD_TO * abs(one.value) for one in found]
    return np.array(
        [
            complex(np.hypot(real or 0.0, least), np.hypot(imaginary or 0.0, least))
            for (real, imaginary), least in zip(pairs, sizes, strict=True)
        ]
    )


def _said(fit: Processes) -> str:
    """Why there are fewer than three processes, or that their signs are not Kawai's; empty where all is as his."""
    names = ", ".join(process.name for process in fit.processes)
    count = len(fit.processes)
    if count == len(_LETTERS):
        usual = all(process.magnitude > 0.0 for process in fit.processes)
        return "" if usual else f"processes {names} have other signs than Kawai's (a lead, a lag, a lead)"
    alone = "; whether it is A or C one alone does not tell" if names == "C" else ""
    return f"{count} process{'es' * (count > 1)} ({names}), no {'second' if count == 1 else 'third'}: {fit.why}{alone}"


def _numbers(fit: Processes, of_noise: bool) -> Mapping[str, Number]:
    """Rates with intervals on their logarithm, magnitudes, and what the fit leaves."""
    why = "" if of_noise else "standard error from what the fit leaves"
    half = fit.width * fit.base_se
    made = {"base_f0_per_l0": Number(fit.base, fit.base_se, fit.base - half, fit.base + half, why)}
    for process in fit.processes:
        by, half = float(np.exp(fit.width * process.rate_log_se)), fit.width * process.magnitude_se
        rate, size, letter = process.rate_per_s, process.magnitude, process.name.lower()
        made[f"rate_{letter}_per_s"] = Number(rate, rate * process.rate_log_se, rate / by, rate * by, why)
        made[f"magnitude_{letter}_f0_per_l0"] = Number(size, process.magnitude_se, size - half, size + half, why)
    for letter in _LETTERS:
        for key in (f"rate_{letter}_per_s", f"magnitude_{letter}_f0_per_l0"):
            made.setdefault(key, Number(None, why=fit.why))
    made["rmsd_share"] = Number(fit.share)
    return made
