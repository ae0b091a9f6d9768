"""Rows of the comparison: what a muscle is, what was fitted of it, how near it comes, and what it costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from xb_muscle_ros.bench.peers.matching import at_bound
from xb_muscle_ros.bench.peers.muscle import Cost, Peer
from xb_muscle_ros.bench.peers.scoring import Score
from xb_muscle_ros.tables import Columns, Filled, filled, number


@dataclass(frozen=True)
class Row:
    """One muscle.

    Attributes:
        key: short name.
        title: what it is called.
        package: that computes it, with version.
        tendon: its series element: ``none``, ``rigid`` or ``elastic``.
        fitted: what was fitted of it to each fibre, and to what.
        values: median of fitted or default parameters over fibres.
        of_fibres: the fitted ones by fibre.
        at_bounds: fitted values that ended at a bound, over all fibres.
        score: beside the measurement.
        costs: of one trial; the default first.
    """

    key: str
    title: str
    package: str
    tendon: str
    fitted: str
    values: Mapping[str, float]
    of_fibres: Mapping[str, Mapping[str, float]]
    at_bounds: int
    score: Score
    costs: Sequence[Cost]

    @property
    def name(self) -> str:
        """Title with what tells it from other rows of the same muscle."""
        return f"{self.title} (series element: {self.tendon}; fitted: {self.fitted})"


def peer_row(
    peer: Peer, package: str, fitted: Mapping[str, Mapping[str, float]], score: Score, costs: Sequence[Cost]
) -> Row:
    """Row of another package's muscle.

    Args:
        peer: the muscle.
        package: that computes it, with version.
        fitted: parameters by fibre; empty mappings where nothing was fitted.
        score, costs: see `Row`.
    """
    medians = {free.name: float(np.median([values[free.name] for values in fitted.values()])) for free in peer.free}
    bounds = sum(len(at_bound(peer, values)) for values in fitted.values())
    what = f"{peer.fitted} to its unconditioned SRS" if peer.free else "nothing"
    values = {**peer.defaults, **medians}
    return Row(peer.key, peer.title, package, peer.tendon, what, values, fitted, bounds, score, costs)


def milliseconds(cost: Cost) -> float:
    """Median of the repeats, ms."""
    return 1e3 * float(np.median(cost.seconds))


def cost_text(cost: Cost) -> str:
    """Time, error and integrator of a trial in words."""
    return f"{milliseconds(cost):.2g} ms, {100.0 * cost.error_f0:.2g} % F0 ({cost.integrator})"


_NAMES = {"tendon_strain": "tendon strain {:.3g}", "vmax_l0_per_s": "vmax {:.3g} L0/s"}


def _values(row: Row) -> str:
    text = ", ".join(_NAMES[name].format(value) for name, value in row.values.items())
    return f"{text} ({row.at_bounds} at a bound)" if row.at_bounds else text


LEFT = (0, 1, 2, 3, 12, 13)
"""Columns of the table that hold words."""


def table(rows: Sequence[Row]) -> Filled:
    """Rows as a table; SRS in F0/L0, isometric force in % F0."""
    columns: Columns[Row] = {
        "muscle": lambda row: row.title,
        "series element": lambda row: row.tendon,
        "fitted to each fibre": lambda row: row.fitted,
        "parameters": _values,
        "isometric force, error (% F0)": lambda row: number(row.score.isometric, ".2g", 100.0),
        "SRS unconditioned, error (F0/L0)": lambda row: number(row.score.unconditioned, ".1f"),
        "relative SRS, large": lambda row: number(row.score.relative["released"]["large"]),
        "small": lambda row: number(row.score.relative["released"]["small"]),
        "all": lambda row: number(row.score.relative["released"]["all"]),
        "reading text, large": lambda row: number(row.score.relative["text"]["large"]),
        "SRS, large (F0/L0)": lambda row: number(row.score.srs["large"], ".1f"),
        "SRS, small (F0/L0)": lambda row: number(row.score.srs["small"], ".1f"),
        "trial by default": lambda row: cost_text(row.costs[0]),
        "trial to 0.1 % F0": lambda row: cost_text(row.costs[-1]),
    }
    return filled(columns, rows)
