"""How programs end where whoever read their output has left, as `head` does."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from xb_muscle_ros.node.client.process import child_environment

# Nodes print nothing but their help, so nothing is half done; argparse swallows the news itself.
NO_ERROR = ("muscle_node", "plant_node", "xb_muscle", "a command")
PROGRAMS = {
    "muscle_node": ["xb_muscle_ros.node.main", "--help"],
    "plant_node": ["xb_muscle_ros.plant.plant_node", "--help"],
    "xb_muscle": ["xb_muscle_ros.cli.main", "--help"],
    "a command": ["xb_muscle_ros.cli.main", "replay", "--help"],
    "a table": ["xb_muscle_ros.cli.main", "parameters"],
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_reader_that_has_left_is_no_error(name: str) -> None:
    """No traceback; where work may be half done the code is the one that shells give for it."""
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
    assert done.returncode == (0 if name in NO_ERROR else 141)
