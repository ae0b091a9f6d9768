"""What a protocol found, as files: JSON, Markdown, CSV and the figure, for each fibre."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from xb_muscle_ros.files import matching, write_json, write_text
from xb_muscle_ros.protocols.base import Cell, Column, Found, Number, Protocol
from xb_muscle_ros.protocols.figures import label
from xb_muscle_ros.scores.estimate import Estimate
from xb_muscle_ros.tables import NOTHING, markdown, number, with_error, write_csv
from xb_muscle_ros.trials.bag_files import plain

FORMAT = 1
"""Version of ``<protocol>.json``."""


def stem(protocol: Protocol) -> str:
    """What the names of the files begin with."""
    return protocol.name.replace("-", "_")


def older_results(folder: Path, protocol: Protocol) -> list[Path]:
    """What an older run of the protocol left in a folder, its bags aside."""
    return matching(
        folder, rf"{stem(protocol)}(\.(json|md|csv)|_{protocol.part}s\.csv)", rf"{stem(protocol)}(_.+)?\.(png|pdf)"
    )


def tree(protocol: Protocol, found: Sequence[Found]) -> dict[str, Any]:
    """``<protocol>.json``: of each fibre, measured and by each model, table and numbers."""
    return {
        "format": FORMAT,
        "protocol": protocol.name,
        "source": protocol.source,
        "found": [
            {
                "fibre": each.fibre,
                "of": each.of,
                "numbers": _numbers(protocol, each.numbers),
                **_at_conditions(protocol, each),
                "rows": [{key: _plain(row.get(key)) for key in protocol.columns} for row in each.rows],
                **_parts(protocol, each),
                "notes": list(each.notes),
            }
            for each in found
        ],
    }


def rows(protocol: Protocol, found: Sequence[Found]) -> list[dict[str, Any]]:
    """The table as records: a standard error has a column of its own, ``<key>_se``."""
    return _records([(each, each.rows) for each in found], protocol.columns)


def _records(
    tables: Sequence[tuple[Found, Sequence[Mapping[str, Cell]]]], columns: Iterable[str]
) -> list[dict[str, Any]]:
    with_se = {
        key
        for _, lines in tables
        for row in lines
        for key, cell in row.items()
        if isinstance(cell, Estimate) and cell.se
    }
    made = []
    for each, lines in tables:
        for row in lines:
            record: dict[str, Any] = {"fibre": each.fibre, "of": each.of}
            for key in columns:
                cell = row.get(key)
                record[key] = cell.value if isinstance(cell, Estimate) else cell
                if key in with_se:
                    record[f"{key}_se"] = cell.se if isinstance(cell, Estimate) else None
            made.append(record)
    return made


def numbers_table(protocol: Protocol, found: Sequence[Found]) -> str:
    """Numbers of each fibre and model, Markdown; empty where the protocol has none."""
    if not protocol.numbers:
        return ""
    columns = protocol.numbers.items()
    having = any(each.numbers_at for each in found)
    head = ["fibre", "of", *(["at"] if having else []), *(column.head for _, column in columns)]
    lines = []
    for each in found:
        for at, numbers in (each.numbers_at or {"": each.numbers}).items():
            begin = [each.fibre, label(each), *([at] if having else [])]
            lines.append([*begin, *(_shown(numbers.get(key), column) for key, column in columns)])
    return markdown(head, lines, (0, 1))


def rows_table(protocol: Protocol, found: Found) -> str:
    """The table of one fibre and model, Markdown; columns without any number are left out."""
    columns = {
        key: column
        for key, column in protocol.columns.items()
        if any(_said(row.get(key), column) for row in found.rows)
    }
    lines = [[_said(row.get(key), column) or NOTHING for key, column in columns.items()] for row in found.rows]
    return markdown([column.head for column in columns.values()], lines)


def write_up(protocol: Protocol, found: Sequence[Found]) -> str:
    """``<protocol>.md``."""
    parts = [f"# Protocol {protocol.name}", f"{protocol.title[0].upper()}{protocol.title[1:]}. ({protocol.source})"]
    if protocol.numbers:
        parts += ["Value ± standard error [95 % interval].", numbers_table(protocol, found)]
    for each in found:
        parts += [f"## {each.fibre}, {label(each)}", rows_table(protocol, each)]
        if each.notes:
            parts.append("\n".join(f"- {line}" for line in each.notes))
    return "\n\n".join(parts) + "\n"


def write(folder: Path, protocol: Protocol, found: Sequence[Found]) -> list[Path]:
    """Write all files; returns what to look at. Each appears whole or not at all."""
    base = folder / stem(protocol)
    write_json(base.with_suffix(".json"), tree(protocol, found))
    write_text(base.with_suffix(".md"), write_up(protocol, found))
    columns = ["fibre", "of", *protocol.columns]
    write_csv(base.with_suffix(".csv"), rows(protocol, found), columns)
    written = [base.with_suffix(suffix) for suffix in (".json", ".md", ".csv")]
    if protocol.part:
        written.append(folder / f"{stem(protocol)}_{protocol.part}s.csv")
        parts = _records([(each, each.parts) for each in found], protocol.part_columns)
        write_csv(written[-1], parts, ["fibre", "of", *protocol.part_columns])
    return [*written, *draw(folder, protocol, found)]


def draw(folder: Path, protocol: Protocol, found: Sequence[Found]) -> list[Path]:
    """Draw the figure of each fibre, PNG, and PDF beside it."""
    from xb_muscle_ros.plotting.style import figure, save

    fibres = list(dict.fromkeys(each.fibre for each in found))
    made = []
    for fibre in fibres:
        name = stem(protocol) if len(fibres) == 1 else f"{stem(protocol)}_{plain(fibre)}"
        mine = [each for each in found if each.fibre == fibre]
        with figure(*protocol.size_mm(mine)) as drawn:
            protocol.draw(drawn, mine)
            save(drawn, folder / f"{name}.png")
        made.append(folder / f"{name}.png")
    return made


def _numbers(protocol: Protocol, numbers: Mapping[str, Number]) -> dict[str, Any]:
    return {key: numbers[key]._asdict() for key in protocol.numbers if key in numbers}


def _at_conditions(protocol: Protocol, found: Found) -> dict[str, Any]:
    """``numbers_at``, for a protocol whose conditions have numbers of their own."""
    if not found.numbers_at:
        return {}
    return {"numbers_at": {at: _numbers(protocol, numbers) for at, numbers in found.numbers_at.items()}}


def _parts(protocol: Protocol, found: Found) -> dict[str, Any]:
    """``cycles``, for a protocol whose trials are made of them."""
    if not protocol.part:
        return {}
    return {f"{protocol.part}s": [{key: _plain(row.get(key)) for key in protocol.part_columns} for row in found.parts]}


def _plain(cell: Cell) -> Any:
    return cell._asdict() if isinstance(cell, Estimate) else cell


def _said(cell: Cell, column: Column) -> str:
    """A cell as text; empty where there is nothing."""
    if isinstance(cell, str):
        return cell
    if isinstance(cell, Estimate):
        text = with_error(cell.value, cell.se, column.form, column.factor)
    else:
        text = number(cell, column.form, column.factor)
    return "" if text == NOTHING else text


def _shown(found: Number | None, column: Column) -> str:
    if found is None or found.value is None:
        return NOTHING
    text = with_error(found.value, found.se, column.form, column.factor)
    if found.low is None and found.high is None:
        return text
    ends: Mapping[str, float | None] = {"low": found.low, "high": found.high}
    low, high = (number(end, column.form, column.factor) for end in ends.values())
    return f"{text} [{low}, {high}]"
