"""Reference of the command line, from the parsers that read it."""

from __future__ import annotations

import argparse
from collections.abc import Iterator

from markdown_table import cell, table


def reference() -> str:
    """A section for each command of ``xb_muscle``."""
    from xb_muscle_ros.cli.main import build_parser

    return "\n".join(_section(name, made, 2) for name, made in _commands(build_parser()))


def _commands(parser: argparse.ArgumentParser) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for made in dict.fromkeys(action.choices.values()):  # a command has one section, whatever its aliases
                yield made.prog, made


def _section(title: str, parser: argparse.ArgumentParser, level: int) -> str:
    """Description, usage and a row for each argument; commands within a command come below it."""
    lines = [f"{'#' * level} {title}", "", cell(parser.description or ""), ""]
    # Python 3.13 breaks the line elsewhere than 3.10, so it is broken here.
    usage = parser.format_usage().removeprefix("usage: ")
    lines += ["```text", *_wrapped(" ".join(usage.split())), "```", ""]
    for group in parser._action_groups:
        rows = [_row(action) for action in group._group_actions if _is_shown(action)]
        if rows:
            head = "argument" if group.title == "positional arguments" else "option"
            if group.title not in ("positional arguments", "options"):
                lines += [f"{cell(group.title or '').capitalize()}:", ""]
            lines += [table((head, "what it does"), rows), ""]
    if parser.epilog:
        lines += [cell(parser.epilog), ""]
    lines += [_section(name, made, level + 1) for name, made in _commands(parser)]
    return "\n".join(lines)


def _is_shown(action: argparse.Action) -> bool:
    return not isinstance(action, (argparse._HelpAction, argparse._SubParsersAction))


def _row(action: argparse.Action) -> tuple[str, str]:
    """Its names with what follows them, and its help."""
    formatter = argparse.HelpFormatter("xb_muscle")
    value = (
        "" if action.nargs == 0 else formatter._format_args(action, formatter._get_default_metavar_for_optional(action))
    )
    if action.option_strings:
        shown = ", ".join(f"`{name}`" for name in action.option_strings) + (f" `{value}`" if value else "")
    else:
        shown = f"`{action.metavar or action.dest}`"
    text = (action.help or "") % {"default": action.default, "prog": "xb_muscle"}
    if action.required and action.option_strings:
        text += " (required)"
    if _is_again(action) and "again" not in text:
        text += " (may be given again)"
    return shown, cell(text)


def _is_again(action: argparse.Action) -> bool:
    return isinstance(action, (argparse._AppendAction, argparse._ExtendAction))


def _wrapped(usage: str, width: int = 96) -> list[str]:
    """A usage line in several, broken between arguments."""
    parts, depth, word = [], 0, ""
    for piece in usage.split(" "):
        word = f"{word} {piece}" if word else piece
        depth += piece.count("[") - piece.count("]")
        if depth == 0:
            parts.append(word)
            word = ""
    lines = [parts[0]]
    for part in parts[1:]:
        if len(lines[-1]) + len(part) < width:
            lines[-1] += f" {part}"
        else:
            lines.append(f"    {part}")
    return lines
