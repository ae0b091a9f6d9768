"""The blocks of the README are found, told apart and run as a reader would."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def program() -> dict[str, Any]:
    """The names that scripts/readme_commands defines."""
    return runpy.run_path(str(ROOT / "scripts" / "readme_commands"))


def test_blocks_keep_order_line_and_reason(program: dict[str, Any]) -> None:
    text = "# T\n\n```bash\na\nb\n```\n\n<!-- not run: needs a robot -->\n```bash\nc\n```\n```python\nd\n```\n"
    assert program["blocks"](text) == [(4, "a\nb\n", ""), (10, "c\n", "needs a robot")]


def test_a_reason_far_from_its_block_does_not_count(program: dict[str, Any]) -> None:
    assert program["blocks"]("<!-- not run: x -->\ntext\n```bash\na\n```\n") == [(4, "a\n", "")]


def test_a_block_stops_at_the_first_failing_command(program: dict[str, Any], tmp_path: Path) -> None:
    block = program["Block"](1, "touch one\nfalse\ntouch two\n", "")
    assert program["run"](block, tmp_path) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["one"]


def test_the_copy_leaves_out_what_is_built(program: dict[str, Any], tmp_path: Path) -> None:
    copy = program["copy_project"](tmp_path)
    assert (copy / "package.xml").is_file()
    assert (copy / "scripts" / "demo").stat().st_mode & 0o100
    assert not (copy / ".git").exists()


def test_what_a_block_exports_is_there_in_the_next_one(program: dict[str, Any], tmp_path: Path) -> None:
    exported = tmp_path / "exported"
    first = program["Block"](1, "export MINE='a b'\nunset NOTHING\n", "")
    second = program["Block"](5, 'test "$MINE" = "a b"\n', "")
    assert [program["run"](block, tmp_path, exported) for block in (first, second)] == [0, 0]


@pytest.mark.parametrize("page", sorted((ROOT / "docs" / "tutorials").glob("*.md")), ids=lambda page: page.name)
def test_tutorials_have_commands_to_run(program: dict[str, Any], page: Path) -> None:
    found = program["blocks"](page.read_text(encoding="utf-8"))
    assert any(not block.reason for block in found)
