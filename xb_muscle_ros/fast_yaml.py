"""YAML through PyYAML's parser and emitter in C, ten times as fast, where the build of PyYAML has them."""

from __future__ import annotations

from typing import Any

import yaml

_SAFE_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_TEXT_LOADER: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
_DUMPER: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
_NO_WRAP = 2**31 - 1


def load(text: str | bytes) -> Any:
    """A document; raises `yaml.YAMLError`."""
    return yaml.load(text, Loader=_SAFE_LOADER)


def load_text(text: str | bytes) -> Any:
    """A document in which every scalar stays the text it is; raises `yaml.YAMLError`."""
    return yaml.load(text, Loader=_TEXT_LOADER)


def dump(tree: object) -> str:
    """A tree with sorted keys, every value on one line."""
    dumped: str = yaml.dump(tree, Dumper=_DUMPER, width=_NO_WRAP, allow_unicode=True, sort_keys=True)
    return dumped
