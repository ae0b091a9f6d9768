"""The one glossary of a diagnosis: its page and its JSON explain their terms from `glossary.yaml`."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import resources
from types import MappingProxyType
from typing import NamedTuple

from xb_muscle_ros import fast_yaml


class Term(NamedTuple):
    """One entry: a title, and a sentence or two."""

    title: str
    text: str


_TEXT = resources.files("xb_muscle_ros.diagnose.report").joinpath("glossary.yaml").read_text(encoding="utf-8")
GLOSSARY: Mapping[str, Term] = MappingProxyType({key: Term(**row) for key, row in fast_yaml.load(_TEXT).items()})
"""Every term by its key."""
