"""YAML through PyYAML's parser and emitter in C, ten times as fast, where the build of PyYAML has them."""

from __future__ import annotations

from typing import Any

import yaml

_SAFE_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_TEXT_LOADER: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
_DUMPER: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
_NO_WRAP = 2**31 - 1


class _OnceLoader(_SAFE_LOADER):  # type: ignore[misc]  # one of two classes, by what is installed
    """YAML allows a key once in a mapping; PyYAML takes the last one without a word."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> Any:
        lines: dict[tuple[str, str], int] = {}
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                line = key.start_mark.line + 1
                first = lines.setdefault((key.tag, key.value), line)
                if first != line:
                    raise yaml.YAMLError(f"key '{key.value}' is there twice, on line {first} and on line {line}")
        return super().construct_mapping(node, deep)


def load(text: str | bytes) -> Any:
    """A document; raises `yaml.YAMLError`, also for a key that is there twice."""
    return yaml.load(text, Loader=_OnceLoader)


def load_text(text: str | bytes) -> Any:
    """A document in which every scalar stays the text it is; raises `yaml.YAMLError`."""
    return yaml.load(text, Loader=_TEXT_LOADER)


def dump(tree: object) -> str:
    """A tree with sorted keys, every value on one line."""
    dumped: str = yaml.dump(tree, Dumper=_DUMPER, width=_NO_WRAP, allow_unicode=True, sort_keys=True)
    return dumped
