"""The options of the command line that say where work is done."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from xb_muscle_ros.cli.common import add_work, work_options_of
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.work import Options


def options(*words: str) -> Options:
    parser = argparse.ArgumentParser()
    add_work(parser)
    return work_options_of(parser.parse_args(words), "fit", Path("journal"))


def test_they_become_options() -> None:
    assert options() == Options(None, None, Path("journal"), "fit")
    assert options("--scheduler", "host:8786").scheduler == "host:8786"
    assert options("--processes", "0").processes == 0


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["--processes", "-1"], r"--processes is -1; allowed is 0 to 1024"),
        (["--processes", "2", "--scheduler", "host:8786"], r"drop one of them"),
    ],
)
def test_out_of_range(words: list[str], line: str) -> None:
    with pytest.raises(UserError, match=line):
        options(*words)
