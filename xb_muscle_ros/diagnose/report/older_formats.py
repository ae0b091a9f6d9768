"""Former formats of `diagnosis.json`: their keys under today's names."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

_RENAMED: Mapping[int, Mapping[str, str]] = MappingProxyType(
    {
        2: {
            "explained_share": "explained_fraction", "share_of_mismatch": "ablation_loss", "remaining": "residual",
            "where": "places", "nuisances": "nuisance_parameters", "noise_from": "noise_source", "how": "glossary",
            "explained": "explained_fraction", "others": "other_scalings",
        },
    }
)  # fmt: skip
READ = tuple(_RENAMED)
"""Former formats that can be read."""
_PLAIN = ("how", "augmented", "map_before", "map_after", "others")
"""Objects whose keys are no fields."""


def renamed(row: Any, version: int) -> Any:
    """What a file of a former format holds, under the keys of the present one."""
    if isinstance(row, list):
        return [renamed(value, version) for value in row]
    if not isinstance(row, Mapping):
        return row
    names = _RENAMED[version]
    return {names.get(k, k): v if k in _PLAIN else renamed(v, version) for k, v in row.items()}
