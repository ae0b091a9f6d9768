"""Inputs with faults that users met, kept beside the repository: each is read rightly, or refused by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from xb_muscle_ros.trials.importing import Failed, Imported, find_recordings, import_recordings
from xb_muscle_ros.trials.readers.mapping import load_mapping
from xb_muscle_ros.trials.readers.settings import ImportSettings

COLUMNS = {
    "time": {"column": "time_s", "unit": "s"},
    "length": {"column": "length_mm", "unit": "mm"},
    "force": {"column": "force_mN", "unit": "mN"},
}
TABLE: dict[str, Any] = {"fibre": "fb", "pca": 6.1, "f0": "1 mN", "columns": COLUMNS}


def sarcomeres(**of: str) -> dict[str, Any]:
    return {**TABLE, "columns": {**COLUMNS, "length": {"column": "sl_um", "unit": "um", **of}}}


def events(shared_cases: Path, tmp_path: Path, name: str, mapping: str | dict[str, Any]) -> list[Imported | Failed]:
    tree = load_mapping(shared_cases / mapping) if isinstance(mapping, str) else mapping
    files = find_recordings([shared_cases / name])
    made = list(import_recordings(files, ImportSettings(tree, "here"), tmp_path / "bags"))
    return [event for event in made if isinstance(event, (Imported, Failed))]


@pytest.mark.parametrize(
    ("name", "mapping", "words"),
    [
        ("bags/clock_jump", "bagmap.yaml", ("/joint_states, message 500", "1699999999.900000000 s", "message 499")),
        ("bags/clock_jump", "bagmap_len.yaml", ("/joint_states, message 500", "1700000000.499000000 s")),
        ("bags/gap", "bagmap.yaml", ("from 0.299 to 0.8 s (0.501 s)", "largest_step")),
        ("tables/gap.csv", "gapmap.yaml", ("line 302", "from 0.299 to 0.8 s (0.501 s); allowed are 0.02 s")),
        ("bags/empty_effort", "bagmap_eff.yaml", ("effort is empty",)),
        ("tables/sarcomere_length.csv", sarcomeres(), ("give --length-of sarcomere",)),
    ],
)
def test_refused(
    shared_cases: Path, tmp_path: Path, name: str, mapping: str | dict[str, Any], words: tuple[str, ...]
) -> None:
    (event,) = events(shared_cases, tmp_path, name, mapping)
    assert isinstance(event, Failed)
    assert all(word in event.why for word in words), event.why
    assert "\n" not in event.why


@pytest.mark.parametrize(
    ("name", "mapping", "samples", "words"),
    [
        ("bags/qos_meta_edited", "bagmap.yaml", 1000, ()),
        ("bags/split_no_metadata", "bagmap.yaml", 1000, ("metadata.yaml is missing",)),
        ("bags/two_publishers", "bagmap.yaml", 500, ("500 of 1000 messages on /joint_states have no joint 'ankle'",)),
        ("bags/truncated", "bagmap.yaml", 692, ("truncated.mcap is cut short",)),
        ("tables/excel_cp1252.csv", TABLE, 500, ("cp1252",)),
        ("tables/decimal_comma.csv", TABLE, 399, ("decimal commas",)),
        ("tables/sarcomere_length.csv", sarcomeres(of="sarcomere"), 1000, ()),
        (
            "tables/sarcomere_length.csv",
            sarcomeres(of="half_sarcomere"),
            1000,
            ("2.4 µm", "is it --length-of sarcomere?"),
        ),
    ],
)
def test_read_and_told(
    shared_cases: Path,
    tmp_path: Path,
    name: str,
    mapping: str | dict[str, Any],
    samples: int,
    words: tuple[str, ...],
) -> None:
    (event,) = events(shared_cases, tmp_path, name, mapping)
    assert isinstance(event, Imported), event.why
    assert event.trial.time_s.size == samples
    told = " ".join(event.trial.warnings)
    assert all(word in told for word in words), told
    assert words or not told
