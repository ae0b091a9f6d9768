"""Fibres as plain data, for tasks that go to other processes and for journals."""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle


def fibre_to_plain(fibre: Fibre) -> dict[str, Any]:
    """A fibre as JSON, whole: a worker elsewhere needs no file, and a changed parameter makes another task."""
    return {
        **fibre.__dict__,
        "values": dict(fibre.values),
        "path": None,
        "available_models": list(fibre.available_models),
        "starts": {},
    }


def fibre_from_plain(row: Mapping[str, Any]) -> Fibre:
    """The fibre of `fibre_to_plain`."""
    fixed = {
        "values": MappingProxyType(dict(row["values"])),
        "available_models": tuple(row["available_models"]),
    }
    return Fibre(**{**row, **fixed})


def muscle_of_plain(row: Mapping[str, Any]) -> Muscle:
    """The same, ready to step; a process keeps the last few."""
    return _muscle(json.dumps(row, sort_keys=True))


@functools.lru_cache(maxsize=64)
def _muscle(text: str) -> Muscle:
    return Muscle(fibre_from_plain(json.loads(text)))
