"""Strain grids: the density of attached heads in bins, with nothing assumed of its shape.

Both methods carry the bins along with the contractile element while they step, so that movement itself costs no
accuracy (van der Zee et al. 2026, method of characteristics). They differ in what happens after a step: characteristics
leave the bins where they are, and renumber them when they have moved by whole bins; the fixed grid interpolates back.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import ClassVar

from xb_muscle_ros.distribution.base import Fluxes, Representation, Settling, Ways
from xb_muscle_ros.mechanisms import Moments, Parameter, Quantities, State

BINS = Parameter("bins", "1", "points of the strain grid", 8.0, 100000.0, 200.0, "van der Zee et al. 2026")
RANGE = Parameter(
    "strain_range", "power strokes", "the grid reaches from minus to plus this strain", 1.5, 200.0, 15.0,
    "van der Zee et al. 2026",
)  # fmt: skip
REGRID = Parameter(
    "regrid", "1", "1: renumber bins that have moved by whole bins, so that no movement leaves the grid; 0: leave them",
    0.0, 1.0, 1.0, "this package",
)  # fmt: skip


@functools.lru_cache(maxsize=16)
def _rows(bins: int, strain_range: float, others: tuple[State, ...]) -> tuple[State, ...]:
    """Rows of a grid's states; kept, because a thousand fibres share them."""
    of_bin = (State(f"n_{i}", "1/power stroke", "density of attached heads", 0.0, 1e4) for i in range(bins))
    # A grid that has moved further no longer covers the strains where heads attach.
    most = strain_range - 1.0
    moved = "how far the grid has moved with the contractile element"
    return (*of_bin, *others, State("grid_shift", "power strokes", moved, -most, most))


class Grid(Representation):
    """Bins n_i at the strains x_i = -range + i dx + shift; moments are sums over bins."""

    parameters: ClassVar[tuple[Parameter, ...]] = (BINS, RANGE)
    states = ()
    # The step's matrix leaves the heads' feedback on their own attachment out: variable steps would grow to the edge of
    # stability and stay restless there, steps of 1 ms come to rest.
    settling = Settling(rate=1e-6, step_s=1e-3)

    def fluxes(self, q: Quantities, ways: Ways) -> Fluxes:
        """Sums over bins, which are not expressions: symbols that the compiled step fills in."""
        return Fluxes(Moments(q.kin0, q.kin1, q.kin2), q.torn_off, q.reattached)

    def state_rows(self, states: tuple[State, ...], values: Mapping[str, float]) -> tuple[State, ...]:
        """Bins first, then the blocks' states, then the shift of the grid."""
        return _rows(int(values["bins"]), values["strain_range"], states)


class Characteristics(Grid):
    """The grid moves with the contractile element; no interpolation, so movement costs no accuracy."""

    name = "characteristics"
    parameters = (BINS, RANGE, REGRID)
    remap = "roll"


class FixedGrid(Grid):
    """The paper's traditional method: linear interpolation back to the grid after every step.

    Interpolation smears the distribution by u h (dx - u h)/2 each step and loses or makes heads at its kinks.
    """

    name = "fixed_grid"
    remap = "linear"


class ConservativeFixedGrid(Grid):
    """The fixed grid, remapped by cubic interpolation of the cumulated heads: heads are neither lost nor made."""

    name = "fixed_grid_conservative"
    remap = "conservative"
