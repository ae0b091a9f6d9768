"""How much of the mismatch a set explains, and the ablation loss of each of its names."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from xb_muscle_ros.diagnose.search.explore import Explorer
from xb_muscle_ros.diagnose.search.system import Names


def explained(explorer: Explorer, names: Names, noise_f0: Sequence[float]) -> float:
    """Share of the base's mean square beyond noise that a set takes away; between 0 and 1."""
    chosen = range(len(explorer.systems))
    before = _excess(explorer, (), noise_f0, chosen)
    return float(np.clip(1.0 - _excess(explorer, names, noise_f0, chosen) / before, 0.0, 1.0)) if before > 0.0 else 0.0


def unique(
    explorer: Explorer, names: Names, without: Names, noise_f0: Sequence[float], fibre: int | None = None
) -> float:
    """Ablation loss of a part of a set, all else fitted anew, as a share of the base's mismatch."""
    chosen = range(len(explorer.systems)) if fibre is None else [fibre]
    before = _excess(explorer, (), noise_f0, chosen)
    if before <= 0.0 or without not in explorer.fits:
        return 0.0
    back = _squares(explorer, without, chosen) - _squares(explorer, names, chosen)
    return float(np.clip(back / before, 0.0, 1.0))


def _squares(explorer: Explorer, names: Names, chosen: Sequence[int]) -> float:
    return float(sum(explorer.fits[names][i].mean_square_f0 for i in chosen))


def _excess(explorer: Explorer, names: Names, noise_f0: Sequence[float], chosen: Sequence[int]) -> float:
    return _squares(explorer, names, chosen) - sum(noise_f0[i] ** 2 for i in chosen)
