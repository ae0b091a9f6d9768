"""The study of large recordings, on a small one."""

from __future__ import annotations

from pathlib import Path

import pytest

from xb_muscle_ros.bench import records
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.trials.bags import read_trial


def test_both_commands_are_measured(tmp_path: Path) -> None:
    fibre = load_fibre("18Dec2017a")
    for found in records.both(tmp_path, "small", 500.0, 12.0, fibre):
        assert found.seconds > 0.1
        assert 20.0 < found.peak_mb < 2000.0
    imported = read_trial(tmp_path / "bags" / "made_small")
    assert imported.time_s.size == imported.force_n.size == 6000
    assert [phase.name for phase in imported.facts.phases][:3] == ["isometric", "stretch", "shortening"]
    assert (tmp_path / "small" / "replay.json").is_file()
    assert read_trial(tmp_path / "small" / "bags" / "small").time_s.size == 6000


def test_a_command_that_fails_is_told(tmp_path: Path) -> None:
    command = [records.sys.executable, "-m", "xb_muscle_ros.cli.main", "replay", str(tmp_path / "none")]
    with pytest.raises(UserError, match=r"records: xb_muscle replay ended with code 2: .*"):
        records.measured(command)
