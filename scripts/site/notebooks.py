"""Jupyter notebooks as pages: cells in their order, with the outputs that the file holds. Nothing is run."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path
from typing import Any, NamedTuple

_COLOURS = re.compile(r"\x1b\[[0-9;]*m")


class NotebookPage(NamedTuple):
    """A notebook as Markdown, and its pictures by the names that the text has for them."""

    text: str
    pictures: dict[str, bytes]


def as_page(path: Path) -> NotebookPage:
    """The page of a notebook file (format 4)."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    parts: list[str] = []
    pictures: dict[str, bytes] = {}
    for cell in cells:
        source = "".join(cell["source"])
        if cell["cell_type"] == "code":
            parts.append(_fenced(source, "python"))
            for output in cell["outputs"]:
                parts.append(_shown(output, path.stem, pictures))
        else:
            parts.append(source)
    return NotebookPage("\n\n".join(part for part in parts if part) + "\n", pictures)


def _shown(output: dict[str, Any], stem: str, pictures: dict[str, bytes]) -> str:
    """One output: a picture, a table as HTML, or text."""
    if output["output_type"] == "stream":
        return _fenced("".join(output["text"]), "text")
    if output["output_type"] == "error":
        return _fenced("\n".join(output["traceback"]), "text")
    data = {kind: "".join(value) if isinstance(value, list) else value for kind, value in output["data"].items()}
    if "image/png" in data:
        name = f"{stem}_{len(pictures) + 1}.png"
        pictures[name] = base64.b64decode(data["image/png"])
        return f"![Output]({name})"
    if "text/html" in data:
        return f'<div class="md-typeset__table">{data["text/html"]}</div>'
    if "text/markdown" in data:
        return data["text/markdown"]
    return _fenced(data.get("text/plain", ""), "text")


def _fenced(text: str, language: str) -> str:
    text = _COLOURS.sub("", text).rstrip()
    fence = "```"
    while fence in text:
        fence += "`"
    return f"{fence}{language}\n{text}\n{fence}" if text else ""
