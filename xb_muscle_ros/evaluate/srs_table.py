"""Tables of SRS over pCa, recovery time and amplitude for a set of fibres: measured ones, the authors', ours."""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.scores.conditions import COMMON_AMPLITUDE_L0, CONDITIONS, activation_class
from xb_muscle_ros.scores.relative import Averaged, ByClass, by_class, nanmean, over_fibres
from xb_muscle_ros.trials.trial import Array

UNCONDITIONED = ("reference", "conditioning")
"""What the test stretch is set beside: the stretch of the reference trial (amplitude 0) of the shortest recovery time,
or the mean of the conditioning stretches of 3.83 % L0, which nothing went before either (the authors' programs)."""

# Axis of a table: key in JSON, unit, allowed range, what is wrong where it is left.
_AXES = (
    ("pCa", "", 3.0, 12.0, "pCa is -log10 of calcium in M"),
    ("recovery_s", " s", 0.0, 1000.0, "recovery times are in s"),
    ("amplitude_L0", " L0", 0.0, 0.5, "amplitudes are fractions of L0"),
)
_QUANTITIES = ("srs_test", "srs_conditioning", "isometric_force")
# Beyond these no fibre answers; a table that does is in another unit.
_LIMITS = {"srs_test": (5000.0, "F0/L0"), "srs_conditioning": (5000.0, "F0/L0"), "isometric_force": (10.0, "F0")}


@dataclass(frozen=True)
class FibreSrs:
    """One fibre; arrays of shape (pca, recovery, amplitude), NaN where not measured.

    Attributes:
        test, conditioning: SRS of the two stretches, F0/L0.
        isometric: force before the first stretch, F0.
        test_se, conditioning_se: standard errors of the SRS, F0/L0, NaN where not known; None for simulated SRS, and
            for tables that have none.
    """

    test: Array
    conditioning: Array
    isometric: Array
    test_se: Array | None = None
    conditioning_se: Array | None = None


@dataclass(frozen=True, eq=False)
class SrsTable:
    """SRS of several fibres on common axes; a table equals itself alone.

    Attributes:
        label: what the values are, for tables and figures.
        pca, recovery_s, amplitude_l0: the axes, 1-D; s and L0.
        fibres: by name.
        repeats_left_out: trials that were left out of their condition's mean for their standard error.
    """

    label: str
    pca: Array
    recovery_s: Array
    amplitude_l0: Array
    fibres: Mapping[str, FibreSrs]
    repeats_left_out: int = 0

    def isometric_f0(self, fibre: str) -> Array:
        """Isometric force at each pCa, shape (pca,), F0: mean over the trials that have it."""
        held = self.fibres[fibre].isometric
        return nanmean(held.reshape(held.shape[0], -1).T)

    def unconditioned(self, fibre: str, kind: str) -> tuple[Array, Array]:
        """SRS of the unconditioned stretch at each pCa, and standard error (NaN where not known), shape (pca,), F0/L0.

        Args:
            kind: one of `UNCONDITIONED`.
        """
        values, errors = np.full(self.pca.size, np.nan), np.full(self.pca.size, np.nan)
        held = self.fibres[fibre]
        if kind == "conditioning":
            column = place(self.amplitude_l0, COMMON_AMPLITUDE_L0)
            if column is None:
                return values, errors
            each = held.conditioning[:, :, column]
            if held.conditioning_se is not None:
                among = np.where(np.isfinite(each), held.conditioning_se[:, :, column] ** 2, 0.0).sum(axis=1)
                errors = np.sqrt(among) / np.maximum(np.isfinite(each).sum(axis=1), 1)
            return nanmean(each.T), errors
        column = place(self.amplitude_l0, 0.0)
        if column is None:
            return values, errors
        order = np.argsort(self.recovery_s)
        reference = held.test[:, order, column]
        for i, row in enumerate(reference):
            known = np.flatnonzero(np.isfinite(row))
            if known.size:
                values[i] = row[known[0]]
                errors[i] = np.nan if held.test_se is None else held.test_se[i, order[known[0]], column]
        return values, errors

    def sound(self, fibre: str, kind: str) -> npt.NDArray[np.bool_]:
        """Which relative SRS say anything, shape (pca, recovery, amplitude).

        Left out are those where the standard error of either SRS is as large as the unconditioned SRS that is divided
        by. Whether the SRS of the test stretch is itself small plays no part: means would come out too high.
        """
        held = self.fibres[fibre]
        below, below_se = (each[:, None, None] for each in self.unconditioned(fibre, kind))
        test_se = np.full(held.test.shape, np.nan) if held.test_se is None else held.test_se
        worse: npt.NDArray[np.bool_] = (test_se >= np.abs(below)) | (below_se >= np.abs(below))
        return ~worse

    def left_out(self, kind: str) -> tuple[int, int]:
        """How many relative SRS are left out for their standard errors, and of how many."""
        out, total = 0, 0
        for name, held in self.fibres.items():
            both = np.isfinite(held.test) & np.isfinite(self.unconditioned(name, kind)[0])[:, None, None]
            total += int(np.count_nonzero(both))
            out += int(np.count_nonzero(both & ~self.sound(name, kind)))
        return out, total

    def classes(self, fibre: str, by: SrsTable | None = None) -> npt.NDArray[np.int64]:
        """Activation class at each pCa, shape (pca,), from the fibre's force here, or in another table."""
        force = self.isometric_f0(fibre)
        if by is not None:
            theirs = by.isometric_f0(fibre) if fibre in by.fibres else np.full(by.pca.size, np.nan)
            places = [place(by.pca, pca) for pca in self.pca]
            force = np.array([np.nan if i is None else theirs[i] for i in places])
        return activation_class(force)

    @functools.lru_cache(maxsize=256)  # noqa: B019 - a run has a few tables, and all of them to its end
    def pooled(self, kind: str, by: SrsTable | None = None) -> dict[str, ByClass]:
        """Each fibre by activation class, shape (classes, recovery, amplitude); see `relative`."""
        found = {}
        for name, fibre in self.fibres.items():
            below, below_se = self.unconditioned(name, kind)
            test = np.where(self.sound(name, kind), fibre.test, np.nan)
            found[name] = by_class(test, below, self.classes(name, by), fibre.test_se, below_se)
        return found

    @functools.cached_property
    def _places_of_conditions(self) -> tuple[tuple[int, int, int], ...]:
        """Condition, recovery and amplitude index of the conditions that the axes have."""
        places = [(place(self.recovery_s, c.recovery_s), place(self.amplitude_l0, c.amplitude_l0)) for c in CONDITIONS]
        return tuple((k, i, j) for k, (i, j) in enumerate(places) if i is not None and j is not None)

    def at_conditions(self, values: Array) -> Array:
        """Of values of shape (..., recovery, amplitude) those at the `CONDITIONS`; NaN where not held."""
        picked = np.full((*values.shape[:-2], len(CONDITIONS)), np.nan)
        for k, i, j in self._places_of_conditions:
            picked[..., k] = values[..., i, j]
        return picked

    def relative(self, averaging: str, kind: str, by: SrsTable | None = None) -> Averaged:
        """Relative SRS over fibres, shape (classes, recovery, amplitude).

        Args:
            averaging: one of `AVERAGINGS`.
            kind: one of `UNCONDITIONED`.
            by: table whose isometric forces make the classes; the fibres' own here where None.
        """
        return over_fibres(list(self.pooled(kind, by).values()), averaging)

    def only(self, fibres: Sequence[str]) -> SrsTable:
        """The same with these fibres alone, as far as there are."""
        kept = {name: fibre for name, fibre in self.fibres.items() if name in fibres}
        return SrsTable(self.label, self.pca, self.recovery_s, self.amplitude_l0, kept)


def near(values: Array, level: float) -> npt.NDArray[np.bool_]:
    """Which values are one nominal value."""
    return np.isclose(values, level, rtol=1e-3, atol=1e-6)


def levels(values: Array) -> Array:
    """Distinct nominal values, ascending, of values without NaN."""
    return np.unique([float(f"{value:.6g}") for value in values])


def place(axis: Array, value: float) -> int | None:
    """Where on an axis a nominal value stands; None where it does not."""
    found = np.flatnonzero(near(axis, value))
    return int(found[0]) if found.size else None


def read_table(path: Path, label: str) -> SrsTable:
    """Read a table such as ``empirical_srs.json``.

    Raises:
        UserError: missing file, malformed JSON, an axis in another unit or with repeats, rows of unequal length, or a
            number that is not finite or beyond what fibres do.
    """
    tree = _json(path)
    return table_of(tree, label, str(path))


def read_tables(path: Path, label: str) -> dict[str, SrsTable]:
    """Read a file that holds several tables by name, such as ``golden_srs.json``; see `read_table`."""
    tree = _json(path)
    named = {name: part for name, part in tree.items() if isinstance(part, dict) and "fibres" in part}
    if not named:
        raise UserError(f"{path} holds no table with 'fibres'; needed is a file such as golden_srs.json")
    return {name: table_of(part, label, f"{path}, table {name}") for name, part in named.items()}


def _json(path: Path) -> dict[str, Any]:
    try:
        tree = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}; give the path of a table of SRS") from error
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise UserError(f"{path} is not valid JSON: {error}") from error
    if not isinstance(tree, dict):
        raise UserError(f"{path} holds {type(tree).__name__}; needed is an object with axes and 'fibres'")
    return tree


def table_of(tree: Mapping[str, Any], label: str, where: str) -> SrsTable:
    """A table from its parsed JSON; see `read_table`."""
    axes = [_axis(tree, *axis, where) for axis in _AXES]
    fibres = tree.get("fibres")
    if not isinstance(fibres, dict) or not fibres:
        raise UserError(f"{where}: 'fibres' is missing or empty; needed is one entry for each fibre")
    shape = tuple(axis.size for axis in axes)
    read = {}
    for name, held in fibres.items():
        if not isinstance(held, dict):
            raise UserError(f"{where}: fibre {name} is {held!r}; needed are {', '.join(_QUANTITIES)}")
        read[str(name)] = FibreSrs(*(_values(held, q, shape, axes, f"{where}: fibre {name}") for q in _QUANTITIES))
    return SrsTable(label, axes[0], axes[1], axes[2], read)


def _axis(tree: Mapping[str, Any], key: str, unit: str, lower: float, upper: float, hint: str, where: str) -> Array:
    held = tree.get(key)
    numbers = isinstance(held, list) and held and all(_is_number(v) for v in held)
    if not numbers:
        raise UserError(f"{where}: axis '{key}' is missing or not a list of numbers; {hint}")
    axis = np.array(held, dtype=np.float64)
    for value in axis:
        if not lower <= value <= upper:
            raise UserError(f"{where}: {key} {value:g} is outside {lower:g} to {upper:g}{unit}; {hint}")
    repeated = [v for i, v in enumerate(axis) if place(axis[:i], float(v)) is not None]
    if repeated:
        raise UserError(f"{where}: {key} {repeated[0]:g} comes twice; every level stands once on its axis")
    return axis


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _values(held: Mapping[str, Any], quantity: str, shape: tuple[int, ...], axes: Sequence[Array], where: str) -> Array:
    """One quantity, checked cell by cell; null becomes NaN."""
    names = [axis[0] for axis in _AXES]
    if quantity not in held:
        raise UserError(f"{where} has no '{quantity}'; needed are {', '.join(_QUANTITIES)}")
    limit, unit = _LIMITS[quantity]
    values = np.full(shape, np.nan)

    def fill(rows: Any, depth: int, at: tuple[int, ...]) -> None:
        place_text = ", ".join(f"{names[d]} {axes[d][i]:g}" for d, i in enumerate(at))
        here = f"{where}, {quantity}" + (f" at {place_text}" if place_text else "")
        if depth < len(shape):
            if not isinstance(rows, list) or len(rows) != shape[depth]:
                found = f"{len(rows)} values" if isinstance(rows, list) else repr(rows)
                raise UserError(f"{here} holds {found}; needed are {shape[depth]}, one for each {names[depth]}")
            for i, row in enumerate(rows):
                fill(row, depth + 1, (*at, i))
        elif rows is not None:
            if not _is_number(rows) or not np.isfinite(rows):
                raise UserError(f"{here} is {rows!r}; allowed are finite numbers, and null where nothing was measured")
            if abs(rows) > limit:
                raise UserError(f"{here} is {rows:g}; allowed is up to {limit:g} {unit}: check the unit")
            values[at] = rows

    fill(held[quantity], 0, ())
    return values
