"""Searches whose fits are written down: sets with costs, so that what follows from them can be worked out by hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from made_trials import given_fibre

from xb_muscle_ros.diagnose.effort import Effort
from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.diagnose.search.descent import Fit
from xb_muscle_ros.diagnose.search.explore import Explorer
from xb_muscle_ros.diagnose.search.system import INDEPENDENT, Names, System, ordered
from xb_muscle_ros.work import Options

NOISE_F0 = 1e-3
COUNT = 100
# Independent residuals.
EFFECTIVE = INDEPENDENT * COUNT
DRAG, TITIN, STIFFNESS = Name.VISCOUS_DRAG, Name.ACTIVE_TITIN, Name.STATIC_CALCIUM_STIFFNESS
VISCO, LATTICE, SHIFT = Name.PASSIVE_VISCOELASTICITY, Name.LATTICE_SPACING, Name.PCA_SHIFT


class ByHand(Explorer):
    """Effects are worth what their fits say, and nothing else."""

    def adjusted(self, names: Names, fibres: Sequence[int]) -> float:
        """Nothing."""
        return 0.0


def fit(names: Sequence[Name], log_likelihood: float, occam: float = 0.0, mean_square_f0: float | None = None) -> Fit:
    """A fit of such a cost: residuals that are as large as it says, or priors that make up for it."""
    # Every name takes off more than what is of use to anyone.
    mean_square = 1e-4 * 0.5 ** len(names) if mean_square_f0 is None else mean_square_f0
    data = 0.5 * EFFECTIVE * float(np.log(NOISE_F0**2 + mean_square))
    return Fit(ordered(names), {}, mean_square, -log_likelihood - data, occam, {}, 1)


def explorer(fits: Mapping[tuple[Name, ...], Sequence[Fit]], count: int = 1) -> ByHand:
    """A search that made these fits, one for each fibre."""
    system = System(given_fibre(), (), np.ones(COUNT), NOISE_F0)
    found = ByHand([system] * count, Effort(), Options(processes=0, quiet=True))
    found.fits = {ordered(names): tuple(own) for names, own in fits.items()}
    return found


def with_odds(*rows: tuple[tuple[Name, ...], float]) -> ByHand:
    """One fibre; sets whose evidence, chances before anything is seen counted in, is this."""
    return explorer({names: [fit(names, value - Explorer.odds(ordered(names)))] for names, value in rows})
