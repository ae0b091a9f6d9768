"""One mapping for many files: defaults of the format, keys per file, and what makes two imports the same."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.registry import READERS, reader_for
from xb_muscle_ros.trials.readers.settings import ImportSettings, MappingError

TREE: dict[str, Any] = {
    "fibre": "f1",
    "columns": {
        "time": {"column": "t", "unit": "s"},
        "length": {"column": "l", "unit": "L0"},
        "force": {"column": "f", "unit": "N"},
    },
    "f0": "1 N",
    "pca": 6.1,
    "per_file": [
        {"files": "^b", "fibre": "f2", "f0": "2 N"},
        {"files": "_late$", "pca": 9.0, "columns": {"force": {"unit": "mN"}}},
    ],
}


def _file(folder: Path, name: str = "a.csv", content: bytes = b"t,l,f\n0,1,1\n") -> Path:
    (folder / name).write_bytes(content)
    return folder / name


@pytest.mark.parametrize(
    ("name", "fibre", "f0_n", "pca", "unit"),
    [("a", "f1", 1.0, 6.1, "N"), ("b", "f2", 2.0, 6.1, "N"), ("b_late", "f2", 2.0, 9.0, "mN")],
)
def test_keys_per_file_go_over_those_for_all(
    tmp_path: Path, name: str, fibre: str, f0_n: float, pca: float, unit: str
) -> None:
    mapping = ImportSettings(TREE, "here").prepare(_file(tmp_path, f"{name}.csv")).mapping
    assert mapping.f0 is not None
    assert mapping.force is not None
    assert (mapping.fibre, mapping.f0.value, mapping.force.unit_name) == (fibre, f0_n, unit)
    assert mapping.facts.get("pca") == pca


def test_options_go_over_keys_per_file_and_null_takes_a_key_out(tmp_path: Path) -> None:
    settings = ImportSettings({**TREE, "per_file": [{"files": ".", "pca": None}]}, "here", overrides={"fibre": "f3"})
    mapping = settings.prepare(_file(tmp_path)).mapping
    assert (mapping.fibre, mapping.facts.get("pca")) == ("f3", None)


@pytest.mark.parametrize(
    ("per_file", "words"),
    [
        ({"files": "."}, "per_file is {'files': '.'}; needed is a list"),
        ([{"fibre": "f"}], "per_file, entry 1: files is missing"),
        ([{"files": "("}], "per_file, entry 1: '(' is no regular expression"),
        ([{"files": ".", "format": "mat"}], "per_file, entry 1 has format; that holds for all files"),
    ],
)
def test_keys_per_file_are_checked_before_any_file(per_file: object, words: str) -> None:
    with pytest.raises(UserError) as refused:
        ImportSettings({**TREE, "per_file": per_file}, "here")
    assert words in str(refused.value)


def test_a_mapping_that_is_wrong_for_a_kind_of_file_is_told_apart(tmp_path: Path) -> None:
    settings = ImportSettings({**TREE, "per_file": [{"files": "^b", "fiber": "x"}]}, "here")
    settings.prepare(_file(tmp_path))
    with pytest.raises(MappingError, match="unknown fiber; did you mean 'fibre'"):
        settings.prepare(_file(tmp_path, "b.csv"))


def test_an_unknown_format_is_answered_with_the_nearest() -> None:
    with pytest.raises(UserError, match="here: format is 'csb'; did you mean 'csv'"):
        ImportSettings({**TREE, "format": "csb"}, "here")


def test_a_wrong_mapping_is_told_at_once_where_the_format_is_known() -> None:
    with pytest.raises(UserError, match=r"columns\.length is missing"):
        ImportSettings({"fibre": "f", "format": "csv", "columns": {"time": TREE["columns"]["time"]}}, "here")


def _digest(path: Path, tree: dict[str, Any], **more: Any) -> str:
    return ImportSettings(tree, "here", **more).prepare(path).digest


def test_digests_tell_settings_apart(tmp_path: Path) -> None:
    file = _file(tmp_path)
    one = _digest(file, TREE)
    assert one == _digest(file, dict(reversed(TREE.items())))
    others = [
        _digest(file, {**TREE, "pca": 6.2}),
        _digest(file, {**TREE, "source": "x"}),
        _digest(file, TREE, isometric_scaling=False),
        _digest(file, TREE, overrides={"fibre": "f9"}),
        _digest(_file(tmp_path, "b.csv"), TREE),
    ]
    assert len({one, *others}) == 6
    # What holds for other files only does not matter.
    assert one == _digest(file, {**TREE, "per_file": [{"files": "^b", "fibre": "f7"}]})
    _digest(file, {**TREE, "isometric_scaling": {"fractions_f0": {4.5: 1.0, "6.1": 0.5}}})  # numbers and text as keys


@pytest.mark.parametrize(
    ("name", "content", "reader"),
    [
        ("a.csv", b"t,l\n", "csv"),
        ("a.TSV", b"t\tl\n", "csv"),
        ("a.dat", b"t;l\n0;1\n", "csv"),
        ("a.slc", b"", "slc"),
        ("a.txt", b"SLCONTROL_DATA_FILE\r\n", "slc"),
        ("a.mat", b"", "mat"),
        ("a.bin", b"MATLAB 5.0 MAT-file, Platform", "mat"),
        ("a.mcap", b"", "bag"),
        ("a.bin", b"\x89MCAP0\r\n", "bag"),
        ("a.db3", b"", "bag"),
        ("a.bin", b"SQLite format 3\x00", "bag"),
    ],
)
def test_formats_are_told_by_name_or_content(tmp_path: Path, name: str, content: bytes, reader: str) -> None:
    assert reader_for(_file(tmp_path, name, content)).name == reader


def test_a_bag_folder_is_a_bag_and_another_folder_is_nothing(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="is a folder without"):
        reader_for(tmp_path)
    (tmp_path / "metadata.yaml").write_text("")
    assert reader_for(tmp_path).name == "bag"


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    with pytest.raises(
        UserError, match=r"a\.bin is of no known format; known: bag, mat, slc, abf, .* csv; name it with"
    ):
        reader_for(_file(tmp_path, "a.bin", b"\x00\x01\x02"))
    with pytest.raises(UserError, match=r"no\.csv cannot be read: No such file"):
        reader_for(tmp_path / "no.csv")
    assert reader_for(_file(tmp_path, "a.bin", b"\x00"), "mat") is READERS["mat"]


@pytest.mark.parametrize("keys", [{"columns": {"trial": {"column": "run"}}}, {"decimal": "comma"}])
def test_what_only_tables_have_is_refused_elsewhere(tmp_path: Path, keys: dict[str, Any]) -> None:
    (tmp_path / "a.slc").write_text("SLCONTROL_DATA_FILE")
    with pytest.raises(MappingError, match=r"(columns\.trial|decimal) is for .*xlsx, csv, the file is slc; leave it"):
        ImportSettings(keys, "here").prepare(tmp_path / "a.slc")


@pytest.mark.parametrize(("unit", "factor"), [("kPa", 1e3), ("N", 1.0)])
def test_f0_of_a_folder_may_be_any_stress_or_force(tmp_path: Path, unit: str, factor: float) -> None:
    rows = "\n".join(f"{i / 1000},1,90" for i in range(100))
    file = _file(tmp_path, content=f"t,l,f\n{rows}\n".encode())
    columns = {**TREE["columns"], "force": {"column": "f", "unit": unit}}
    tree = {**TREE, "columns": columns, "f0": {"isometric_at_pca": 4.5}, "pca": 4.5, "per_file": []}
    mapping = ImportSettings(tree, "here").prepare(file).mapping
    assert mapping.f0 is not None
    assert mapping.f0.value == pytest.approx(90.0 * factor)
