"""HTML in small pieces: escaped text, numbers that link to how they were computed, tables and figures with captions."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Iterable, Sequence

_UNITS = re.compile(r"\b([FL])0\b")
NOTHING = "–"
"""A cell without a value."""


def escaped(text: object) -> str:
    """Any text, as it is, safe between tags and in attributes; what no page may hold becomes U+FFFD."""
    kept = "".join(c if c >= " " or c in "\t\n" else "\ufffd" for c in str(text))
    return html.escape(kept.encode("utf-8", "replace").decode("utf-8"), quote=True)


def prose(text: object) -> str:
    """Escaped words of the tool's own, with F0 and L0 as physiologists print them."""
    return _UNITS.sub(r"\1<sub>0</sub>", escaped(text))


def named(text: object) -> str:
    """A name that came with the data, escaped; it may break anywhere, so that long ones leave room beside them."""
    return f'<span class="any">{escaped(text)}</span>'


class Markup:
    """Pieces of one page; remembers what was linked and counts figures and tables.

    Attributes:
        linked: entries of ``how`` that some number links to, in order of first use.
    """

    def __init__(self) -> None:
        self.linked: dict[str, None] = {}
        self._figures = 0
        self._tables = 0

    def number(self, text: str, how: str) -> str:
        """A number as a link to how it was computed."""
        self.linked.setdefault(how)
        return f'<a class="n" href="#{anchor(how)}">{prose(text)}</a>'

    def cell(self, text: str | None, how: str) -> str:
        """A number, or a dash where there is none."""
        return NOTHING if text is None else self.number(text, how)

    def figure(self, drawn: Sequence[str], caption: str, alternative: str) -> str:
        """SVG pages of one figure; each prints whole, the caption follows the first."""
        if not drawn:
            return ""
        self._figures += 1
        out = []
        for page, svg in enumerate(drawn):
            data = base64.b64encode(svg.encode("utf-8")).decode("ascii")
            of = f", part {page + 1} of {len(drawn)}" if len(drawn) > 1 else ""
            words = caption if page == 0 else "Continued."
            out.append(
                f'<figure><img alt="{escaped(alternative + of)}" src="data:image/svg+xml;base64,{data}">'
                f"<figcaption><b>Figure {self._figures}{of}.</b> {words}</figcaption></figure>"
            )
        return "\n".join(out)

    def table(
        self, caption: str, head: Sequence[str], rows: Iterable[tuple[str, Sequence[str]]], words: int = 1
    ) -> str:
        """A table.

        Args:
            caption: HTML.
            head: HTML of the column heads.
            rows: class of the row (or empty) and HTML of its cells.
            words: so many columns from the left hold words; the others hold numbers and are set to the right.
        """
        self._tables += 1
        heads = "".join(f'<th scope="col"{_side(k, words)}>{cell}</th>' for k, cell in enumerate(head))
        body = []
        for name, cells in rows:
            inner = "".join(f"<td{_side(k, words)}>{cell}</td>" for k, cell in enumerate(cells))
            body.append(f'<tr class="{name}">{inner}</tr>' if name else f"<tr>{inner}</tr>")
        return (
            f"<table><caption><b>Table {self._tables}.</b> {caption}</caption><thead><tr>{heads}</tr></thead>"
            f"<tbody>{''.join(body)}</tbody></table>"
        )


def anchor(how: str) -> str:
    """Id of an entry on how a number was computed."""
    return "how-" + "".join(c if c.isascii() and (c.isalnum() or c == "_") else f"-{ord(c):x}-" for c in how)


def listed(items: Sequence[str], name: str = "") -> str:
    """A list of HTML items; nothing where there are none."""
    if not items:
        return ""
    return (
        f"<ul{f' class={chr(34)}{name}{chr(34)}' if name else ''}>{''.join(f'<li>{item}</li>' for item in items)}</ul>"
    )


def _side(column: int, words: int) -> str:
    return "" if column < words else ' class="r"'
