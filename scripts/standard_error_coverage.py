"""How right standard errors from quiet times are: of means and slopes, in made noise, at several sampling rates.

Printed for each rate, kind of noise and quiet time: standard errors over true ones (median, smallest and largest of the
records), of means and slopes over three spans.
"""

from __future__ import annotations

import argparse

import numpy as np
import numpy.typing as npt
from scipy.linalg import matmul_toeplitz
from scipy.signal import lfilter

from xb_muscle_ros.scores.standard_error import force_noise
from xb_muscle_ros.trials.trial import Phase, Trial, TrialFacts

Array = npt.NDArray[np.float64]

_SD_F0 = 1e-3
_RATES_HZ = (1000.0, 2500.0, 5000.0, 20_000.0)
_QUIET_S = (0.1, 0.3, 1.0)
_SPANS_S = (0.005, 0.05, 0.5)
# Time in which noise fades (s; 0: white), and share of its variance; the rest is white.
_KINDS = {
    "white": (0.0, 0.0),
    "2 ms": (2e-3, 1.0),
    "20 ms": (0.02, 1.0),
    "100 ms": (0.1, 1.0),
    "20 ms, half": (0.02, 0.5),
}


def main() -> None:
    """Print a row for each rate, kind of noise and quiet time."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--records", type=int, default=12, help="of each kind")
    given = parser.parse_args()
    print("rate Hz | noise fades in | quiet s | " + " | ".join(f"mean; slope over {1e3 * s:g} ms" for s in _SPANS_S))
    for rate_hz in _RATES_HZ:
        for quiet_s in _QUIET_S:
            for name, kind in _KINDS.items():
                cells = _cells(rate_hz, quiet_s, kind, given.records)
                print(f"{rate_hz:g} | {name} | {quiet_s:g} | " + " | ".join(cells), flush=True)


def _cells(rate_hz: float, quiet_s: float, kind: tuple[float, float], records: int) -> list[str]:
    known = [force_noise(_trial(np.random.default_rng(seed), rate_hz, quiet_s, kind)) for seed in range(records)]
    cells = []
    for span_s in _SPANS_S:
        time_s = np.arange(round(span_s * rate_hz)) / rate_hz
        from_middle = time_s - time_s.mean()
        told = []
        for weights in (np.full(time_s.size, 1.0 / time_s.size), from_middle / (from_middle @ from_middle)):
            true = _SD_F0 * np.sqrt(weights @ matmul_toeplitz(_autocorrelation(time_s, kind), weights))
            ratios = [each.of_sum(weights, time_s) / true for each in known if each is not None]
            told.append(f"{np.median(ratios):.2f} ({min(ratios):.2f}–{max(ratios):.2f})")
        cells.append("; ".join(told))
    return cells


def _autocorrelation(time_s: Array, kind: tuple[float, float]) -> Array:
    tau_s, share = kind
    found = share * np.exp(-time_s / tau_s) if tau_s else np.zeros(time_s.size)
    found[0] = 1.0
    return found


def _trial(random: np.random.Generator, rate_hz: float, quiet_s: float, kind: tuple[float, float]) -> Trial:
    tau_s, share = kind
    time_s = np.arange(round((quiet_s + 0.05) * rate_hz)) / rate_hz
    memory = float(np.exp(-1.0 / (rate_hz * tau_s))) if tau_s else 0.0
    begun = int(5.0 * rate_hz * tau_s)
    fresh = np.sqrt(1.0 - memory**2) * random.standard_normal(begun + time_s.size)
    noise = np.sqrt(share) * lfilter([1.0], [1.0, -memory], fresh)[begun:]
    noise += np.sqrt(1.0 - share) * random.standard_normal(time_s.size)
    phases = (Phase("isometric", 0.0, quiet_s), Phase("stretch", quiet_s, float(time_s[-1])))
    length = 1.0 + np.clip(time_s - quiet_s, 0.0, None)
    facts = TrialFacts("f", "t", 4.5, phases=phases)
    return Trial(facts, time_s, length, np.zeros(1), np.ones(1), time_s, 0.5 + _SD_F0 * noise)


if __name__ == "__main__":
    main()
