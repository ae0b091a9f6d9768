"""Random stretches and calcium, for as many ticks as one likes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

CHUNK = 50_000
_LENGTH_L0 = (-0.06, 0.06)
_SPEED_L0_PER_S = (0.01, 20.0)
_PCA = (4.5, 8.0)
_STEP_S = (2e-4, 5e-3)


class Stretches(NamedTuple):
    """Input of some ticks: stamps (ns), lengths (L0), and calcium (µM) with the index of the tick it comes before."""

    stamps_ns: npt.NDArray[np.int64]
    length_l0: Array
    calcium_before: npt.NDArray[np.intp]
    calcium_um: Array


def random_stretches(ticks: int, seed: int) -> Iterator[Stretches]:
    """Ramps to random lengths at random speeds, holds, uneven stamps, calcium that jumps every 50 ticks or so.

    Args:
        ticks: in all; they come in chunks of `CHUNK`.
        seed: of the random numbers.
    """
    rng = np.random.default_rng(seed)
    begin_ns, length = 0, 0.0
    for first in range(0, ticks, CHUNK):
        count = min(CHUNK, ticks - first)
        dt_ns = _log_uniform(rng, _STEP_S, count) * 1e9
        stamps = begin_ns + np.cumsum(np.maximum(dt_ns.astype(np.int64), 1))
        lengths = np.empty(count)
        k = 0
        while k < count:
            run = min(int(rng.integers(1, 60)), count - k)
            seconds = (stamps[k : k + run] - (stamps[k - 1] if k else begin_ns)) * 1e-9
            target = rng.uniform(*_LENGTH_L0)
            speed = float(_log_uniform(rng, _SPEED_L0_PER_S, 1)[0])
            lengths[k : k + run] = length + np.clip(target - length, -speed * seconds, speed * seconds)
            length = float(lengths[k + run - 1])
            k += run
        begin_ns = int(stamps[-1])
        before = np.unique(np.concatenate([[0], rng.integers(0, count, count // 50)]))
        yield Stretches(stamps, lengths, before, 10.0 ** (6.0 - rng.uniform(*_PCA, before.size)))


def _log_uniform(rng: np.random.Generator, bounds: tuple[float, float], count: int) -> Array:
    """Numbers as often in one decade as in another."""
    found: Array = np.exp(rng.uniform(math.log(bounds[0]), math.log(bounds[1]), count))
    return found
