"""The import command: files in, bags out, one line each."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.cli import import_command
from xb_muscle_ros.cli.main import build_parser
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.bags import find_bags, read_trial
from xb_muscle_ros.trials.readers.registry import READERS

OPTIONS = [
    *("--fiber", "cat", "--pca", "4.5", "--f0", "36 N", "--reference-length", "42.8 mm", "--length-is", "change"),
    *("--time-column", "time_s", "--time-unit", "s", "--length-column", "dl", "--length-unit", "mm"),
    *("--force-column", "force_n", "--force-unit", "N"),
]


def run(*arguments: str | Path) -> int:
    args = build_parser().parse_args(["import", *map(str, arguments)])
    code: int = args.run(args)
    return code


def _recording(path: Path, force: str = "9") -> Path:
    time_s = np.arange(200) / 1000
    change_mm = np.interp(time_s, [0, 0.1, 0.15, 0.2], [0, 0, 2.14, 2.14])
    rows = [f"{t!r},{dl!r},{force}" for t, dl in zip(time_s.tolist(), change_mm.tolist(), strict=True)]
    path.write_text("\n".join(["time_s,dl,force_n", *rows]))
    return path


def test_options_alone_make_a_bag(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = _recording(tmp_path / "ramp 1.csv")
    assert run(file, "--out", tmp_path / "bags", *OPTIONS) == 0
    trial = read_trial(tmp_path / "bags" / "cat_ramp_1")
    assert (trial.facts.fibre, trial.facts.trial, trial.facts.pca) == ("cat", "ramp 1", 4.5)
    assert trial.length_change_l0[-1] == pytest.approx(0.05)
    assert trial.measured_f0.tolist() == [0.25] * 200
    assert [p.name for p in trial.facts.phases] == ["isometric", "test_stretch", "hold"]
    line, last = capsys.readouterr().out.splitlines()
    assert line.startswith(f"{tmp_path / 'bags' / 'cat_ramp_1'}: 200 samples, 0.199 s, pCa 4.5")
    assert last == "1 imported, 0 kept, 0 left out"


def test_every_reader_can_be_asked_for() -> None:
    assert sorted(import_command.FORMATS) == sorted(READERS)


def test_options_go_before_the_mapping(tmp_path: Path) -> None:
    mapping = tmp_path / "m.yaml"
    mapping.write_text(
        "fibre: cat\npca: 9.0\nf0: 36 N\nreference_length: 42.8 mm\ncolumns:\n  time: {column: time_s, unit: s}\n"
        "  length: {column: dl, unit: mm, is: change}\n  force: {column: force_n, unit: mN}\n"
    )
    file = _recording(tmp_path / "a.csv")
    assert run(file, "--mapping", mapping, "--out", tmp_path, "--pca", "6.5", "--force-unit", "N") == 0
    trial = read_trial(tmp_path / "cat_a")
    assert trial.facts.pca == 6.5
    assert trial.measured_f0[0] == 0.25


def test_a_bag_that_exists_is_kept_unless_told_otherwise(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(_recording(tmp_path / "a.csv"), "--out", tmp_path, *OPTIONS)
    changed = _recording(tmp_path / "a.csv", force="18")
    assert run(changed, "--out", tmp_path, *OPTIONS) == 2
    assert "cat_a exists, made of another content of a.csv; use --overwrite" in capsys.readouterr().err
    assert read_trial(tmp_path / "cat_a").force_n[0] == 9.0
    assert run(changed, "--out", tmp_path, "--overwrite", *OPTIONS) == 0
    assert read_trial(tmp_path / "cat_a").force_n[0] == 18.0


def test_a_broken_file_is_named_and_the_rest_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = [_recording(tmp_path / "a.csv"), _recording(tmp_path / "b.csv", "nan"), _recording(tmp_path / "c.csv")]
    assert run(*files, "--out", tmp_path / "bags", *OPTIONS) == 1
    captured = capsys.readouterr()
    (error,) = captured.err.splitlines()
    assert error.startswith(f"xb_muscle: error: {files[1]}, line 2, column 'force_n' holds 'nan'")
    assert captured.out.splitlines()[-1] == "2 imported, 0 kept, 1 left out"
    assert [bag.name for bag in find_bags([tmp_path / "bags"])] == ["cat_a", "cat_c"]


def test_strict_stops_at_the_first(tmp_path: Path) -> None:
    files = [_recording(tmp_path / "a.csv"), _recording(tmp_path / "b.csv", "nan"), _recording(tmp_path / "c.csv")]
    with pytest.raises(UserError, match=r"b\.csv, line 2, column 'force_n' holds 'nan'"):
        run(*files, "--out", tmp_path / "bags", "--strict", *OPTIONS)
    assert [bag.name for bag in find_bags([tmp_path / "bags"])] == ["cat_a"]


def test_a_run_that_reads_nothing_says_so(tmp_path: Path) -> None:
    files = [_recording(tmp_path / name, "nan") for name in ("a.csv", "b.csv")]
    assert run(*files, "--out", tmp_path / "bags", *OPTIONS) == 2
    assert not (tmp_path / "bags").exists()


def test_a_second_run_keeps_what_is_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = [_recording(tmp_path / "a.csv"), _recording(tmp_path / "b.csv")]
    run(files[0], "--out", tmp_path / "bags", *OPTIONS)
    before = {file: file.stat().st_mtime_ns for file in (tmp_path / "bags" / "cat_a").iterdir()}
    capsys.readouterr()
    assert run(*files, "--out", tmp_path / "bags", *OPTIONS) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"{tmp_path / 'bags' / 'cat_a'}: kept, made of the same file with the same mapping"
    assert lines[-1] == "1 imported, 1 kept, 0 left out"
    assert before == {file: file.stat().st_mtime_ns for file in (tmp_path / "bags" / "cat_a").iterdir()}


def test_a_folder_is_imported_whole(tmp_path: Path) -> None:
    (tmp_path / "data" / "more").mkdir(parents=True)
    for name in ("b.csv", "more/a.csv"):
        _recording(tmp_path / "data" / name)
    (tmp_path / "data" / "notes.txt").write_text("no recording")
    for _ in range(2):  # the bags of the first run are no recordings of the second
        assert run(tmp_path / "data", "--out", tmp_path / "data" / "bags", *OPTIONS) == 0
    assert [bag.name for bag in find_bags([tmp_path / "data" / "bags"])] == ["cat_a", "cat_b"]


def test_an_empty_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    with pytest.raises(UserError, match="data holds no recording; looked for: bags, "):
        run(tmp_path / "data", *OPTIONS)


def test_two_files_of_one_name_become_one_bag(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "x").mkdir()
    files = [_recording(tmp_path / "a.csv"), _recording(tmp_path / "x" / "a.csv", force="18")]
    for more in ([], ["--overwrite"]):
        assert run(*files, "--out", tmp_path / "bags", *OPTIONS, *more) == 1
        assert f"{files[1]}, trial a, and {files[0]} would both become" in capsys.readouterr().err
        assert read_trial(tmp_path / "bags" / "cat_a").force_n[0] == 9.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (["--length-unit", "furlong"], "options: unit 'furlong' of length is not known"),
        (["--mapping", "nowhere.yaml"], "mapping nowhere.yaml cannot be read"),
    ],
)
def test_mistakes_in_the_mapping_stop_the_run(tmp_path: Path, change: list[str], words: str) -> None:
    with pytest.raises(UserError) as refused:
        run(_recording(tmp_path / "a.csv"), "--out", tmp_path, *OPTIONS, *change)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (["--length-column", "dx"], "has no column 'dx'; its columns: time_s, dl, force_n"),
        (["--isometric-scaling"], "isometric scaling needs isometric_scaling.fractions_f0"),
        (["--format", "slc"], "a.csv does not begin with SLCONTROL_DATA_FILE"),
    ],
)
def test_mistakes_are_told_in_one_line(
    tmp_path: Path, change: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(_recording(tmp_path / "a.csv"), "--out", tmp_path, *OPTIONS, *change) == 2
    (error,) = capsys.readouterr().err.splitlines()
    assert words in error


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"force": "nan"}, "line 2, column 'force_n' holds 'nan' (a run of 200 lines)"),
        ({"cut": True}, "line 150, column 'force_n' holds nothing"),
        ({"options": ["--length-unit", "m", "--reference-length", "5 m"]}, "L0 is 5 m; fibres have 1e-05 to 0.7 m"),
        ({"options": ["--time-unit", "ms"]}, "samples are 1e-06 s apart"),
        ({"options": ["--force-unit", "kPa", "--f0", "36 Pa"]}, "f0 is 36 Pa; allowed is 1000 to 2e+06 Pa"),
        ({"pca": None}, "a.csv: calcium is not known; give --pca"),
        ({"twice": True}, "would both become"),
    ],
)
def test_bad_input_gives_one_line_and_no_half_bag(
    tmp_path: Path, change: dict[str, Any], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = _recording(tmp_path / "a.csv", change.get("force", "9"))
    if "cut" in change:
        lines = file.read_text().splitlines()
        file.write_text("\n".join([*lines[:149], lines[149].rpartition(",")[0], *lines[150:]]))
    options = [*OPTIONS, *change.get("options", [])]
    if "pca" in change:
        del options[options.index("--pca") : options.index("--pca") + 2]
    files = [file, file] if "twice" in change else [file]
    try:
        code, told = run(*files, "--out", tmp_path / "bags", *options), capsys.readouterr().err
    except UserError as problem:  # of the mapping: the command line prints it
        code, told = 2, f"{problem}\n"
    assert code == (1 if "twice" in change else 2)
    assert words in told
    assert told.count("\n") == 1
    assert len(list((tmp_path / "bags").glob("*"))) == (1 if "twice" in change else 0)


def test_the_data_set_is_imported_with_and_without_scaling(repo_root: Path, shared_data: Path, tmp_path: Path) -> None:
    files = sorted((shared_data / "recordings" / "rat_soleus_18Dec2017a").glob("amp*.csv"))
    mapping = repo_root / "scripts" / "datasets" / "rat_soleus_18Dec2017a.yaml"
    assert run(*files, "--mapping", mapping, "--out", tmp_path / "scaled") == 0
    assert run(*files, "--mapping", mapping, "--out", tmp_path / "raw", "--no-isometric-scaling") == 0
    assert len(find_bags([tmp_path / "scaled"])) == 5
    name = "rat_soleus_18Dec2017a_amp383_rt1ms_pca61"
    scaled, raw = read_trial(tmp_path / "scaled" / name), read_trial(tmp_path / "raw" / name)
    # 66.32 kPa before the stretch, F0 96.70 kPa; 0.5165 F0 in the isometric trials.
    assert raw.measured_f0[0] == pytest.approx(66.23326 / 96.70)
    assert scaled.measured_f0 / raw.measured_f0 == pytest.approx(np.full(501, 0.516474 / (66.32 / 96.70)), rel=1e-3)
    assert "force multiplied by 0.753" in scaled.facts.source
    assert "multiplied" not in raw.facts.source
