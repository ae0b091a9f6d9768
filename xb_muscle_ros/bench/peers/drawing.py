"""Measured relative SRS beside the muscles, and score against cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.bench.peers.rows import Row, milliseconds
from xb_muscle_ros.evaluate.figures.look import MEASURED
from xb_muscle_ros.evaluate.figures.profile import Profile
from xb_muscle_ros.evaluate.srs_table import SrsTable
from xb_muscle_ros.plotting.style import figure, save
from xb_muscle_ros.scores.conditions import COMMON_AMPLITUDE_L0, COMMON_CLASS, COMMON_RECOVERY_S

_TOP = 3.0


class _Look(NamedTuple):
    colour: str
    marker: str
    dashes: tuple[float, ...]


# By the first part of a row's key; distinguished by marker, dash and lightness.
_LOOKS = {
    "millard": _Look("#c1440e", "s", (4, 1.5)),
    "thelen": _Look("#e9b44c", "D", (2, 1)),
    "degroote": _Look("#117a55", "v", (6, 1.5, 1, 1.5)),
    "mujoco": _Look("#5e3c99", "P", (1, 1)),
    "hill_se": _Look("#8ecdf0", "^", (7, 2)),
    "3state_coop": _Look("#0b4f8a", "o", ()),
}
"""Rows that are drawn as lines."""
_ALONG = {
    "amplitude": f"{COMMON_CLASS} activation, recovery {1e3 * COMMON_RECOVERY_S:g} ms",
    "recovery": f"{COMMON_CLASS} activation, {100 * COMMON_AMPLITUDE_L0:g} % L$_0$",
}


def draw(path: Path, data: SrsTable, tables: Mapping[str, SrsTable], rows: Sequence[Row]) -> None:
    """Draw profiles of relative SRS, the peers as they come above and fitted below, and RMSD against cost.

    Args:
        path: of the PNG; a PDF goes beside it.
        data: measured SRS.
        tables: simulated SRS by the key of a row.
        rows: as in the table.
    """
    ours = [row.key for row in rows if row.key in ("hill_se", "3state_coop")]
    plain = [row.key for row in rows if row.key in _LOOKS and row.key not in ours]
    fitted = [row.key for row in rows if row.key.endswith("_vmax")]
    with figure(180.0, 120.0) as made:
        grid = made.add_gridspec(2, 3)
        for line, (keys, words) in enumerate(((plain, "peers as they come"), (fitted, "peers fitted"))):
            for column, along in enumerate(_ALONG):
                axis = made.add_subplot(grid[line, column])
                _profile(axis, along, data, {key: tables[key] for key in (*keys, *ours)})
                axis.set_title(f"{'ABCD'[2 * line + column]}  {words}", loc="left", fontweight="bold")
                if column == 0:
                    axis.set_ylabel("Relative SRS")
        _cost(made.add_subplot(grid[:, 2]), rows)
        named = {}
        for axis in made.axes[:4]:
            handles, labels = axis.get_legend_handles_labels()
            named.update(dict(zip(labels, handles, strict=True)))
        made.legend(list(named.values()), list(named), loc="outside upper center", ncols=4, frameon=False)
        save(made, path)


def _look(key: str) -> _Look:
    return _LOOKS.get(key) or _LOOKS.get(key.split("_")[0]) or _Look("#555555", "X", ())


def _profile(axis: Any, along: str, data: SrsTable, tables: Mapping[str, SrsTable]) -> None:
    axis.axhline(1.0, color="black", linewidth=0.6, linestyle=(0, (1, 2)))
    x, y, sd = Profile(data, along).means()
    axis.errorbar(
        x, y, sd, fmt="o", color=MEASURED, markersize=5.5, capsize=1.5, linewidth=1.0, zorder=4,
        label="measured, mean ± s.d. of fibres",
    )  # fmt: skip
    highest = np.array([_TOP])
    for key, table in tables.items():
        way = _look(key)
        x, y, _ = Profile(table, along).means()
        order = np.argsort(x)
        axis.plot(
            x[order], y[order], color=way.colour, linestyle=(0, way.dashes) if way.dashes else "-", linewidth=1.2,
            marker=way.marker, markersize=3.4, label=table.label, zorder=5,
        )  # fmt: skip
        highest = np.append(highest, y)
    axis.set_ylim(0.0, 1.05 * float(np.max(highest)))
    axis.text(0.98, 0.97, _ALONG[along], transform=axis.transAxes, ha="right", va="top", fontsize=6.5)
    if along == "recovery":
        axis.set_xscale("log")
        axis.set_xlabel("Recovery time (s)")
    else:
        axis.set_xlabel("Conditioning stretch (% L$_0$)")


def _cost(axis: Any, rows: Sequence[Row]) -> None:
    for row in rows:
        way, value = _look(row.key), row.score.relative["released"]["large"]
        if value is not None:
            fill = "white" if row.fitted == "nothing" else way.colour
            axis.plot(milliseconds(row.costs[-1]), value, way.marker, color=way.colour, markerfacecolor=fill)
    axis.set_xscale("log")
    axis.set_xlabel("Time of a trial to 0.1 % F$_0$ (ms)")
    axis.set_ylabel("RMSD of relative SRS")
    axis.set_ylim(bottom=0.0)
    axis.set_title("E  large reductions", loc="left", fontweight="bold")
    words = "open: nothing fitted\nfilled: fitted\ncrosses: our other models"
    axis.text(0.03, 0.99, words, transform=axis.transAxes, va="top", fontsize=6.5)
