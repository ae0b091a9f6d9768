"""One fibre: constants, and the parameter set of one model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any


@dataclass(frozen=True)
class Fibre:
    """One fibre with the parameter set that was chosen.

    Attributes:
        name: of the fibre, for example ``18Dec2017a``.
        model: name of the parameter set, for example ``3state_coop`` or ``3state_coop_v3``, or of a variant that uses
            the set of its base, for example ``3state_coop_rigid``.
        method: representation of the strain distribution, for example ``gaussian``.
        values: every parameter of the set's model, defaults filled in, in the table's units.
        reference_length_m: length at rest, one L0.
        f0_n: isometric force at pCa 4.5, one F0.
        source: where the set's values come from: what the file says of this set under ``sources``, else of all.
        path: the file, or None where the values came as parameters.
        available_models: sets that the file holds; their variants are available as well.
        starts: of parameters that no set gives, all values that the catalogue of mechanisms would begin a fit with,
            the first of them in `values`; empty unless asked for.
    """

    name: str
    model: str
    method: str
    values: Mapping[str, float]
    reference_length_m: float
    f0_n: float
    source: str
    path: Path | None
    available_models: tuple[str, ...]
    starts: Mapping[str, tuple[float, ...]] = field(default_factory=dict, compare=False)

    def __getstate__(self) -> dict[str, Any]:
        """For pickle and deepcopy, which know no read-only mappings."""
        return {**self.__dict__, "values": dict(self.values), "starts": dict(self.starts)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        read_only = {name: MappingProxyType(state[name]) for name in ("values", "starts")}
        self.__dict__.update({**state, **read_only})
