"""The bar, on a terminal and elsewhere."""

from __future__ import annotations

import fcntl
import os
import pty
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest
from conftest import child_environment

from xb_muscle_ros.progress import Progress

SCRIPT = """
import sys
from xb_muscle_ros.progress import Progress
with Progress(int(sys.argv[1]) or None, "fit") as progress:
    progress.skip(2)
    progress.write("a line", sys.stderr)
    for _ in range(3):
        progress.update()
"""


def on_a_terminal(tmp_path: Path, total: int) -> str:
    """What the script writes to a terminal of 80 columns."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    command = [sys.executable, "-c", SCRIPT, str(total)]
    with subprocess.Popen(command, env=child_environment(), stderr=theirs, stdout=theirs) as process:
        os.close(theirs)
        said = b""
        # The end of a terminal is an error on Linux.
        try:
            while part := os.read(ours, 4096):
                said += part
        except OSError:
            pass
    os.close(ours)
    assert process.returncode == 0
    return said.decode()


def test_count_share_and_label_on_a_terminal(tmp_path: Path) -> None:
    last = on_a_terminal(tmp_path, 8).split("\r")[-2]
    assert last.startswith("fit:  62%|")
    assert " 5/8 [00:00<00:0" in last


def test_count_alone_where_the_total_is_not_known(tmp_path: Path) -> None:
    last = on_a_terminal(tmp_path, 0).split("\r")[-2]
    assert last.startswith("fit: 5 [")


def test_a_line_does_not_run_into_the_bar(tmp_path: Path) -> None:
    assert "\ra line\r\n" in on_a_terminal(tmp_path, 8)


def test_nothing_elsewhere(capsys: pytest.CaptureFixture[str]) -> None:
    with Progress(3, "fit") as progress:
        progress.skip()
        progress.update(2)
        assert not progress.shown
    assert capsys.readouterr() == ("", "")


def test_quiet_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with Progress(3, quiet=True) as progress:
        assert not progress.shown
