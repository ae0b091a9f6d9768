"""How programs end where whoever read their output has left, as `head` does."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from xb_muscle_ros.node.process import child_environment

PROGRAMS = {
    "muscle_node": ["xb_muscle_ros.node.main", "--help"],
    "plant_node": ["xb_muscle_ros.plant.plant_node", "--help"],
    "xb_muscle": ["xb_muscle_ros.cli.main", "--help"],
    "a command": ["xb_muscle_ros.cli.main", "replay", "--help"],
    "a table": ["xb_muscle_ros.cli.main", "parameters"],
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_reader_that_has_left_is_no_error(name: str) -> None:
    """No traceback; the code is the one that shells give for it, or argparse has swallowed the news itself."""
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = subprocess.run(
            [sys.executable, "-m", *PROGRAMS[name]],
            stdout=writing,
            stderr=subprocess.PIPE,
            text=True,
            env=child_environment(1),
            timeout=120,
            check=False,
        )
    finally:
        os.close(writing)
    assert done.stderr == ""
    assert done.returncode in ((0, 141) if name in ("xb_muscle", "a command") else (141,))
