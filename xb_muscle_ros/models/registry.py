"""Named models: each a row of blocks. A block brings its own name, so that a new one needs its file alone.

A name is that of a model, and behind it any number of mechanisms: ``3state_coop+viscous_drag+active_titin``.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product
from types import MappingProxyType
from typing import Any

from xb_muscle_ros import plugins
from xb_muscle_ros.distribution.base import Representation
from xb_muscle_ros.distribution.gaussian import Gaussian
from xb_muscle_ros.distribution.grid import Characteristics, ConservativeFixedGrid, FixedGrid
from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.mechanisms import Extra, InSeries, Mechanism, Needs, Series, discovery
from xb_muscle_ros.models import checking
from xb_muscle_ros.models.composition import Composition, Model
from xb_muscle_ros.models.hill import Hill

BLOCKS = discovery.found()
"""Every block, family by family."""
checking.refuse_incomplete(BLOCKS)
METHODS: Mapping[str, type[Representation]] = {
    method.name: method for method in (Gaussian, Characteristics, FixedGrid, ConservativeFixedGrid)
}
SEPARATOR = "+"
"""Between a model's name and those of the mechanisms that come with it."""
EXTRAS: Mapping[str, type[Extra]] = MappingProxyType({b.name: b for b in BLOCKS if issubclass(b, Extra)})
"""Mechanisms that come on top of a model's blocks."""
SWAPS: Mapping[str, type[Mechanism]] = MappingProxyType(
    {b.entry.name or b.name: b for b in BLOCKS if b.entry is not None and not issubclass(b, Extra)}
)
"""Mechanisms that take the place of a block of the model."""


@dataclass(frozen=True)
class Row:
    """The blocks of a model.

    Attributes:
        blocks: one of each of its families, by slot.
        extras: mechanisms on top of them.
    """

    blocks: Mapping[str, type[Mechanism]]
    extras: tuple[type[Extra], ...] = ()

    @property
    def has(self) -> frozenset[Needs]:
        """What mechanisms can act on."""
        thick, series = self.blocks.get("thick_filament"), self.blocks["series"]()
        found = {
            Needs.NOTHING: True,
            Needs.HEADS: thick is not None,
            Needs.SUPER_RELAXED: thick is not None and bool(thick.states),
            Needs.SEPARATE_LENGTHS: thick is None or (isinstance(series, Series) and not series.follows_force),
        }
        return frozenset(need for need, there in found.items() if there)

    def with_block(self, block: type[Mechanism]) -> Row:
        """The row with another block of a family that it has."""
        return replace(self, blocks={**self.blocks, block.family.value: block})

    def composed(self, name: str, method: type[Representation]) -> Model:
        """The model, with a representation of the heads' strain if it has heads."""
        made: dict[str, Any] = {slot: block() for slot, block in self.blocks.items()}
        extras, module = tuple(extra() for extra in self.extras), _same_as(self, name)
        if Needs.HEADS in self.has:
            return Composition(f"{module}_{method.name}", **made, representation=method(), extras=extras)
        return Hill(module, **made, extras=extras)


# Of a compiled module's name; the rest is a hash.
_LONGEST = 120


def _same_as(row: Row, name: str) -> str:
    """Name of the compiled module: models of the same blocks share it, whatever they are called."""
    bare = replace(row, extras=())
    own = "_with_".join(part for part in name.split(SEPARATOR) if part not in EXTRAS)
    same = next((known for known, blocks in MODELS.items() if blocks == bare), own)
    named = "_with_".join([same, *(extra.name for extra in row.extras)])
    # File systems allow names of 255 bytes.
    return named if len(named) <= _LONGEST else f"{named[:_LONGEST]}_{hashlib.sha256(named.encode()).hexdigest()[:8]}"


def _row(**names: str) -> Row:
    """A row of blocks by slot and name; what a model of heads does not say is as in the paper's."""
    if "thick_filament" in names:
        names = {"attachment": "gaussian", "detachment": "regular"} | names
    names = {"series": "exponential", "parallel": "linear"} | names
    known = {(block.family.value, block.name): block for block in BLOCKS}
    return Row({slot: known[slot, name] for slot, name in names.items()})


_BASES: Mapping[str, Row] = {
    "2state": _row(thin_filament="sigmoid", thick_filament="always_on"),
    "2state_coop": _row(thin_filament="cooperative", thick_filament="always_on"),
    "3state_coop": _row(thin_filament="cooperative", thick_filament="force_dependent"),
    "4state_coop": _row(thin_filament="cooperative", thick_filament="force_dependent", detachment="forcible"),
    "hill_se": _row(activation="sigmoid", force_velocity="logarithmic"),
}
# What the field calls a base with its first suffix.
_KNOWN_AS = {"hill_se_rigid": "hill"}


def _variants() -> Iterator[tuple[str, str, Row]]:
    """Name, base and blocks of every model, bases first: each also comes with blocks that have a suffix."""
    others = [block for block in BLOCKS if block.suffix]
    for chosen in sorted(product((False, True), repeat=len(others))):
        blocks = [block for block, wanted in zip(others, chosen, strict=True) if wanted]
        if len(blocks) > len({block.family for block in blocks}):
            continue
        for base, row in _BASES.items():
            name = "_".join([base, *(block.suffix for block in blocks)])
            for long, short in _KNOWN_AS.items():
                name = short + name.removeprefix(long) if name.startswith(long) else name
            if all(block.family.value in row.blocks for block in blocks):
                yield name, base, functools.reduce(Row.with_block, blocks, row)


MODELS: Mapping[str, Row] = MappingProxyType({name: row for name, _, row in _variants()})
BASE_OF: Mapping[str, str] = MappingProxyType({name: base for name, base, _ in _variants()})
"""Model whose parameter set a model can use: itself, or the one that it is a variant of."""


def place_of(mechanism: str) -> str:
    """What only one mechanism of a model can take: a family's place, or that in series; empty: none."""
    if mechanism in SWAPS:
        return SWAPS[mechanism].family.value
    return "in series" if issubclass(EXTRAS[mechanism], InSeries) else ""


def _with_mechanism(row: Row, name: str, taken: dict[str, str], where: str) -> Row:
    """A row with one more mechanism.

    Raises:
        UserError: unknown, there already, in another one's place, or with nothing in the model to act on.
    """
    if name in EXTRAS:
        extra = EXTRAS[name]
        if extra in row.extras:
            raise UserError(f"{where}: mechanism '{name}' is named twice; name it once")
        _take(place_of(name), name, taken, where)
        return _met(replace(row, extras=(*row.extras, extra)), where)
    if name not in SWAPS:
        told = f"{where}: mechanism '{name}' is not known{suggest(name, (*EXTRAS, *SWAPS))}"
        if not any(discovery.is_outside(block) for block in BLOCKS):
            told += f"{' ' if told.endswith('?') else '; '}(of your own none is there: {plugins.VARIABLE} is not set)"
        raise UserError(told)
    block = SWAPS[name]
    slot = block.family.value
    if slot not in row.blocks:
        needed = f"a block of {slot}" if Needs.HEADS in row.has else Needs.HEADS.value
        raise UserError(f"{where}: mechanism '{name}' needs {needed}, which this model does not have")
    if row.blocks[slot] is block:
        raise UserError(f"{where}: mechanism '{name}' is part of this model already; leave it out")
    _take(place_of(name), name, taken, where)
    return _met(row.with_block(block), where)


def _met(row: Row, where: str) -> Row:
    """The row, if it has what its mechanisms need.

    Raises:
        UserError: names the mechanism, the need, and variants of the model that have it.
    """
    for extra in row.extras:
        if extra.needs in row.has:
            continue
        told = f"{where}: mechanism '{extra.name}' needs {extra.needs.value}, which this model does not have"
        alike = [name for name, other in MODELS.items() if extra.needs in other.has and _but_for_series(other, row)]
        raise UserError(f"{told}; take {' or '.join(alike)} in its place" if alike else told)
    return row


def _take(place: str, name: str, taken: dict[str, str], where: str) -> None:
    if place and place in taken:
        raise UserError(f"{where}: mechanisms '{taken[place]}' and '{name}' take the same place; name one of them")
    taken[place] = name


def _but_for_series(one: Row, other: Row) -> bool:
    first, second = ({**row.blocks, "series": None} for row in (one, other))
    return first == second


@functools.cache
def row_of(model: str) -> Row:
    """Blocks of a model with its mechanisms.

    Raises:
        UserError: see `split_set`.
    """
    stem, *mechanisms = model.split(SEPARATOR)
    row, taken = MODELS[stem], dict[str, str]()
    for name in mechanisms:
        row = _with_mechanism(row, name, taken, f"model '{model}'")
    return row


def base_of(model: str) -> str:
    """Model whose parameter set a model can start from, without mechanisms: see `BASE_OF`."""
    return BASE_OF[model.split(SEPARATOR)[0]]


def with_mechanisms(name: str, *mechanisms: str) -> str:
    """Name of a set or model with more mechanisms."""
    return SEPARATOR.join([name, *mechanisms])


def split_set(name: str, where: str = "") -> tuple[str, str]:
    """Model that a parameter set belongs to, and its version: '3state_coop_v3' is ('3state_coop', '_v3').

    Args:
        name: of the set: that of a model, or with ``_v`` and a number behind; then its mechanisms.
        where: begins the message; a file, say.

    Raises:
        UserError: no such model or mechanism, or none that goes with the model; the nearest name is suggested.
    """
    whole, *mechanisms = name.split(SEPARATOR)
    stem, _, version = whole.rpartition("_v")
    plain = stem if stem and version.isdigit() else whole
    if plain not in MODELS:
        raise UserError(f"{where}{': ' if where else ''}model '{plain}' is not known{suggest(plain, MODELS)}")
    model = with_mechanisms(plain, *mechanisms)
    row_of(model)
    return model, whole[len(plain) :]


def model_of_set(name: str, where: str = "") -> str:
    """Model that a parameter set of a fibre file belongs to: see `split_set`."""
    return split_set(name, where)[0]


PUSHES_F0 = -1e-3
"""Force below it, F0, is a push; rounding of a slack fibre stays above."""


def slack_of(name: str) -> str | None:
    """Set or model of the same blocks whose series spring goes slack; None where it does already.

    Raises:
        UserError: see `split_set`.
    """
    model, version = split_set(name)
    stem, *mechanisms = model.split(SEPARATOR)
    block = next(block for block in BLOCKS if block.suffix == "slack")
    if row_of(model).blocks["series"] is block:
        return None
    wanted = MODELS[stem].with_block(block)
    slack = next(known for known, row in MODELS.items() if row == wanted)
    return with_mechanisms(slack + version, *mechanisms)


def compose(model: str, method: str = "gaussian") -> Model:
    """Build the named model for the named method.

    Raises:
        UserError: model or method unknown.
    """
    if method not in METHODS:
        raise UserError(f"method '{method}' is not known{suggest(method, METHODS)}")
    name = model_of_set(model)
    return row_of(name).composed(name, METHODS[method])


def _refuse_wrong(name: str, block: type[Mechanism]) -> None:
    """Try a mechanism from outside on one model of each kind that it goes with; see `checking.refuse_wrong`."""
    pairs = []
    for stem, row in MODELS.items():
        with contextlib.suppress(UserError):
            other = _with_mechanism(row, name, {}, stem)
            pairs.append((row.composed(stem, Gaussian), other.composed(stem, Gaussian)))
    checking.refuse_wrong(block, pairs)


for _name, _block in {**SWAPS, **EXTRAS}.items():
    if discovery.is_outside(_block):
        _refuse_wrong(_name, _block)
