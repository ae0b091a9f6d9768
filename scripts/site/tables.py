"""Tables of the reference pages, from the tables that the package itself works with."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterable, Mapping
from types import ModuleType
from typing import Any

from markdown_table import cell, span, table


class _Absent(ModuleType):
    """Stands for a module of ROS while a table that lies beside ROS code is read: every name in it is a bare class."""

    def __getattr__(self, name: str) -> type:
        if name.startswith("__"):
            raise AttributeError(name)
        return type(name, (Exception,), {})


_OF_ROS = ("rclpy", "rclpy.exceptions", "rclpy.parameter", "rcl_interfaces", "rcl_interfaces.msg")


def _of_node() -> ModuleType:
    """The module of the node's parameters, read without ROS whether that is there or not."""
    for name in _OF_ROS:
        sys.modules.setdefault(name, _Absent(name))
    from xb_muscle_ros.node import parameters

    return parameters


def node_parameters() -> str:
    """Parameters of ``muscle_node``."""
    return _rows_of(_of_node().NODE_PARAMETERS)


def plant_parameters() -> str:
    """Parameters of ``plant_node``."""
    _of_node()
    from xb_muscle_ros.plant.plant_parameters import PLANT_PARAMETERS

    return _rows_of(PLANT_PARAMETERS)


def _rows_of(rows: Mapping[str, Any]) -> str:
    head = ("parameter", "type", "default", "unit", "allowed", "meaning", "can be set")
    return table(head, [_node_row(name, row) for name, row in rows.items()])


def _node_row(name: str, row: Any) -> tuple[str, ...]:
    kind = {bool: "bool", int: "integer", float: "double", str: "string", tuple: "string array"}[type(row.default)]
    default = str(row.default).lower() if kind == "bool" else row.default
    shown = "empty" if default in ("", ("",)) else f"`{default}`"
    allowed = ", ".join(f"`{choice}`" for choice in row.choices) or span(*row.bounds)
    return f"`{name}`", kind, shown, row.unit, allowed, cell(row.meaning), row.when


def models() -> str:
    """Named models without variants: a row for each, a column for each block."""
    from xb_muscle_ros.models.registry import BASE_OF, MODELS
    from xb_muscle_ros.models.titles import title_of

    slots = list(dict.fromkeys(slot for row in MODELS.values() for slot in row.blocks))
    used = [name for name in MODELS if BASE_OF[name] == name or name == "hill"]
    rows = [
        [f"`{name}`", cell(title_of(name)), *(_block(MODELS[name].blocks.get(slot)) for slot in slots)] for name in used
    ]
    return table(["model", "in the paper", *(slot.replace("_", " ") for slot in slots)], rows)


def _block(block: Any) -> str:
    return "–" if block is None else f"`{block().name}`"


def methods() -> str:
    """Representations of the distribution of strain."""
    from xb_muscle_ros.models.registry import METHODS

    return table(("method", "what it is"), [(f"`{name}`", _first(method)) for name, method in METHODS.items()])


def mechanisms() -> str:
    """Mechanisms beside a model's blocks: what each is, and what it needs."""
    from xb_muscle_ros.models.registry import EXTRAS, SWAPS

    rows = [
        (f"`{name}`", _first(extra), cell(extra.needs.value), ", ".join(f"`{p.name}`" for p in extra.parameters))
        for name, extra in EXTRAS.items()
    ]
    for name, block in SWAPS.items():
        what = f"in place of the model's {block.family.value.replace('_', ' ')}: {_first(block)}"
        rows.append((f"`{name}`", what, "", ", ".join(f"`{p.name}`" for p in block.parameters)))
    return table(("mechanism", "what it is", "needs", "parameters"), rows)


def physical_parameters() -> str:
    """Every physical parameter with unit, range and source."""
    from xb_muscle_ros.models.parameters import CONSTANTS, PARAMETERS

    return _table_of([*CONSTANTS.values(), *PARAMETERS.values()])


def _table_of(rows: Iterable[Any]) -> str:
    head = ("parameter", "unit", "allowed", "default", "meaning", "source")
    return table(
        head,
        [
            (
                f"`{row.name}`",
                cell(row.unit),
                span(row.lower, row.upper),
                "" if row.default is None else f"{row.default:g}",
                cell(row.meaning),
                cell(row.source),
            )
            for row in rows
        ],
    )


def _first(what: type) -> str:
    """First paragraph of a docstring."""
    return cell((inspect.getdoc(what) or "").partition("\n\n")[0].rstrip("."))
