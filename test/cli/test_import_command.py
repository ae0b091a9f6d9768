"""The import command: files in, bags out, one line each."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.cli import import_command
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.bags import find_bags, read_trial

OPTIONS = [
    *("--fiber", "cat", "--pca", "4.5", "--f0", "36 N", "--reference-length", "42.8 mm", "--length-is", "change"),
    *("--time-column", "time_s", "--time-unit", "s", "--length-column", "dl", "--length-unit", "mm"),
    *("--force-column", "force_n", "--force-unit", "N"),
]


def run(*arguments: str | Path) -> int:
    parser = argparse.ArgumentParser("xb_muscle")
    import_command.add(parser.add_subparsers())
    args = parser.parse_args(["import", *map(str, arguments)])
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
    (line,) = capsys.readouterr().out.splitlines()
    assert line.startswith(f"{tmp_path / 'bags' / 'cat_ramp_1'}: 200 samples, 0.199 s, pCa 4.5")


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


def test_a_bag_that_exists_is_kept_unless_told_otherwise(tmp_path: Path) -> None:
    run(_recording(tmp_path / "a.csv"), "--out", tmp_path, *OPTIONS)
    changed = _recording(tmp_path / "a.csv", force="18")
    with pytest.raises(UserError, match=r"cat_a exists; use --overwrite"):
        run(changed, "--out", tmp_path, *OPTIONS)
    assert read_trial(tmp_path / "cat_a").force_n[0] == 9.0
    assert run(changed, "--out", tmp_path, "--overwrite", *OPTIONS) == 0
    assert read_trial(tmp_path / "cat_a").force_n[0] == 18.0


def test_nothing_is_written_when_one_file_is_bad(tmp_path: Path) -> None:
    good, bad = _recording(tmp_path / "a.csv"), _recording(tmp_path / "b.csv", force="nan")
    with pytest.raises(UserError, match=r"b\.csv, line 2, column 'force_n' holds 'nan'"):
        run(good, bad, "--out", tmp_path / "bags", *OPTIONS)
    assert not (tmp_path / "bags").exists()


def test_two_files_of_one_name_are_refused(tmp_path: Path) -> None:
    (tmp_path / "x").mkdir()
    files = [_recording(tmp_path / "a.csv"), _recording(tmp_path / "x" / "a.csv")]
    with pytest.raises(UserError, match="would both become"):
        run(*files, "--out", tmp_path, *OPTIONS)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (["--length-column", "dx"], "has no column 'dx'; its columns: time_s, dl, force_n"),
        (["--length-unit", "furlong"], "options: unit 'furlong' of length is not known"),
        (["--mapping", "nowhere.yaml"], "mapping nowhere.yaml cannot be read"),
        (["--isometric-scaling"], "isometric scaling needs isometric_scaling.fractions_f0"),
    ],
)
def test_mistakes_are_told_in_one_line(tmp_path: Path, change: list[str], words: str) -> None:
    with pytest.raises(UserError) as refused:
        run(_recording(tmp_path / "a.csv"), "--out", tmp_path, *OPTIONS, *change)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("data_set", "trial", "name"),
    [
        ("cat", "ramp 1", "cat_ramp_1"),
        ("cat", "cat_1", "cat_1"),
        ("c/a..t", "é", "c_a..t__"),
        ("..", "x", "_x"),
    ],
)
def test_bag_names_are_plain(data_set: str, trial: str, name: str) -> None:
    assert import_command.bag_name(data_set, trial) == name


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
