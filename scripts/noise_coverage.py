"""How right noise is that was taken from what smooth curves leave of force: its size, its spread and false alarms.

Made studies of three trials, a stretch and a hold in which force falls from 30 % F0, with noise of known size and
memory and without any mismatch. Printed for each kind: the estimated size over the true one (median, 5 and 95 %), in
what share of trials draws cover the noise that was there (2 to 98 %), and of studies p <= 0.05 and a mismatch beyond
the practical floor.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.noise.cells import Residual
from xb_muscle_ros.diagnose.noise.significance import significance
from xb_muscle_ros.fit.linear_fit import LinearFit
from xb_muscle_ros.scores.noise.model import NoiseModel
from xb_muscle_ros.scores.noise.pieces import evenly_sampled, smooth_pieces
from xb_muscle_ros.scores.noise.trials import by_curves
from xb_muscle_ros.trials.trial import Phase, Trial, TrialFacts

Array = npt.NDArray[np.float64]

_SDS_F0 = (2e-3, 1e-3, 4e-3)
_DRAWS = 100


class Kind(NamedTuple):
    """One kind of study.

    Attributes:
        ramp_s, hold_s: durations.
        step_s: between samples; None for 20 samples in the ramp and 80 further and further apart in the hold.
        tau_s: within which noise fades.
        share: of its variance; the rest is white.
    """

    ramp_s: float
    hold_s: float
    step_s: float | None
    tau_s: float
    share: float


_KINDS = (
    *(Kind(0.08, hold_s, 1e-3, 0.02, 1.0) for hold_s in (0.05, 0.1, 0.3)),
    Kind(0.01, 0.3, None, 0.02, 1.0),
    *(Kind(0.1, 60.0, None, tau_s, share) for tau_s, share in ((1e-3, 0.5), (0.02, 0.9), (1.0, 0.9), (5.0, 0.5))),
    *(Kind(1.0, 10.0, 0.15, tau_s, 0.9) for tau_s in (1e-3, 0.3, 2.0)),
)


def main() -> None:
    """Print a row for each kind of study and shape of the fall."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--studies", type=int, default=40, help="of each kind")
    given = parser.parse_args()
    print("ramp s | hold s | step s | fades in s (share) | fall | size, 5-95 % | covered | p <= 0.05 | beyond floor")
    for kind in _KINDS:
        for shape in ("exponentials", "power", "active"):
            _print_row(kind, shape, given.studies)


def _print_row(kind: Kind, shape: str, studies: int) -> None:
    ratios, covered, alarms, detected = [], [], 0, 0
    for seed in range(studies):
        random = np.random.default_rng(seed)
        times = _times(kind)
        noise = [sd * _fading(random, times, kind) for sd in _SDS_F0]
        trials = [_trial(f"t{i}", times, kind, shape, e) for i, e in enumerate(noise)]
        even = {t.facts.trial: evenly_sampled(t.force_time_s) for t in trials}
        model = NoiseModel(tuple(by_curves({t.facts.trial: smooth_pieces(t) for t in trials}, even).values()))
        for of_trial, sd, e in zip(model.trials, _SDS_F0, noise, strict=True):
            ratios.append(of_trial.sd_f0 / sd)
            drawn = NoiseModel((of_trial,)).draw([times], _DRAWS, random)
            low, high = np.quantile(np.sqrt(np.mean(drawn**2, axis=0)), [0.02, 0.98])
            covered.append(low < np.sqrt(np.mean(e**2)) < high)
        found = significance(*_fitted(trials, noise), model, _DRAWS, seed)
        alarms += found.overall_p <= 0.05
        detected += found.detected(0.01)
    low, middle, high = np.quantile(ratios, [0.05, 0.5, 0.95])
    step = "uneven" if kind.step_s is None else f"{kind.step_s:g}"
    print(
        f"{kind.ramp_s:g} | {kind.hold_s:g} | {step} | {kind.tau_s:g} ({kind.share:g}) | {shape} | {middle:.2f}, "
        f"{low:.2f}-{high:.2f} | {np.mean(covered):.2f} | {alarms / studies:.2f} | {detected / studies:.2f}",
        flush=True,
    )


def _times(kind: Kind) -> Array:
    if kind.step_s is not None:
        return np.arange(round((kind.ramp_s + kind.hold_s) / kind.step_s) + 1) * kind.step_s
    apart = kind.ramp_s + np.geomspace(kind.ramp_s / 20.0, kind.hold_s, 79)
    return np.concatenate([np.linspace(0.0, kind.ramp_s, 20, endpoint=False), [kind.ramp_s], apart])


def _fading(random: np.random.Generator, time_s: Array, kind: Kind) -> Array:
    """Noise of unit size."""
    slow = random.normal(size=time_s.size)
    for k, kept in enumerate(np.exp(-np.diff(time_s) / kind.tau_s)):
        slow[k + 1] = kept * slow[k] + np.sqrt(1.0 - kept**2) * slow[k + 1]
    mixed: Array = np.sqrt(kind.share) * slow + np.sqrt(1.0 - kind.share) * random.normal(size=time_s.size)
    return mixed


def _trial(name: str, time_s: Array, kind: Kind, shape: str, noise_f0: Array) -> Trial:
    since = np.maximum(time_s - kind.ramp_s, 0.0)
    fall = {
        "exponentials": 0.4 + 0.3 * np.exp(-since / (0.01 * kind.hold_s)) + 0.3 * np.exp(-since / (0.5 * kind.hold_s)),
        "power": (1.0 + 10.0 * since / kind.ramp_s) ** -0.25,
        "active": 0.6 + 0.5 * np.exp(-20.0 * since / kind.hold_s) - 0.1 * np.exp(-5.0 * since / kind.hold_s),
    }[shape]
    moved = np.minimum(time_s / kind.ramp_s, 1.0)
    phases = (Phase("stretch", 0.0, kind.ramp_s), Phase("hold", kind.ramp_s, float(time_s[-1])))
    facts = TrialFacts("made", name, 6.0, phases=phases)
    force = 0.3 * np.where(since > 0.0, fall, np.expm1(3.0 * moved) / np.expm1(3.0)) + noise_f0
    return Trial(facts, time_s, 1.0 + 0.2 * moved, np.zeros(1), np.ones(1), time_s, force)


def _fitted(trials: Sequence[Trial], noise: Sequence[Array]) -> tuple[list[Residual], LinearFit]:
    """What a fit of level, drift and stiffness leaves of the noise, the transients being known."""
    columns = [np.column_stack([np.ones(t.time_s.size), t.time_s / t.time_s[-1], t.length_change_l0]) for t in trials]
    slopes = np.concatenate(columns)
    fit = LinearFit(slopes, np.full(slopes.shape[0], 90.0), np.ones(3))
    left = np.split(fit.residual(np.concatenate(noise)[:, None])[:, 0], np.cumsum([e.size for e in noise])[:-1])
    found = [
        Residual(t.facts.trial, 6.0, t.time_s, e, t.facts.phases, t.length_change_l0, np.ones(e.size))
        for t, e in zip(trials, left, strict=True)
    ]
    return found, fit


if __name__ == "__main__":
    main()
