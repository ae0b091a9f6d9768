"""Files looked into: what is recognised, what is left open, and that the mapping imports what was recognised."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.bags import read_trial, write_trial
from xb_muscle_ros.trials.importing import Imported, import_recordings
from xb_muscle_ros.trials.inspecting.figure import _drawn, draw
from xb_muscle_ros.trials.inspecting.inspection import inspect_file, one_mapping
from xb_muscle_ros.trials.inspecting.report import report, rows
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.readers.mapping import load_mapping
from xb_muscle_ros.trials.readers.settings import ImportSettings

TIME_S = np.arange(400) / 1000.0
LENGTH_MM = np.interp(TIME_S, [0.1, 0.2], [1.2, 1.25])
FORCE_MN = 0.3 + np.interp(TIME_S, [0.1, 0.2], [0.0, 0.1])


def table(path: Path, columns: dict[str, np.ndarray], delimiter: str = ",", comments: str = "") -> Path:
    lines = [delimiter.join(columns)]
    lines += [delimiter.join(f"{value:.9g}" for value in row) for row in zip(*columns.values(), strict=True)]
    path.write_text(comments + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def imports(files: list[Path], mapping: str, out: Path) -> list[Imported]:
    file = out / "mapping.yaml"
    out.mkdir(exist_ok=True)
    file.write_text(mapping, encoding="utf-8")
    events = list(import_recordings(files, ImportSettings(load_mapping(file), str(file)), out / "bags"))
    return [event for event in events if isinstance(event, Imported)]


def test_a_table_whose_names_tell_everything_imports_by_its_mapping(tmp_path: Path) -> None:
    file = table(
        tmp_path / "ramp_pCa6.1.csv",
        {"Time (s)": TIME_S, "Length (mm)": LENGTH_MM, "Force (mN)": FORCE_MN},
        comments="# fibre: mine\n# F0 = 0.5 mN\n# reference_length: 1.2 mm\n",
    )
    found = inspect_file(file)
    assert found.imports
    assert not found.proposal.missing
    [event] = imports([file], found.proposal.text, tmp_path / "out")
    assert event.trial.facts == found.trials[0].facts
    assert (event.trial.facts.fibre, event.trial.facts.pca, event.trial.facts.f0_n) == ("mine", 6.1, 0.5e-3)
    assert event.trial.facts.reference_length_m == pytest.approx(1.2e-3)
    assert [phase.name for phase in event.trial.facts.phases] == ["isometric", "test_stretch", "hold"]
    assert draw(tmp_path / "p.png", found) is not None
    assert (tmp_path / "p.png").stat().st_size > 1000


def test_what_is_missing_waits_in_the_mapping(tmp_path: Path) -> None:
    file = table(tmp_path / "a.csv", {"t": TIME_S, "L": LENGTH_MM, "F": FORCE_MN})
    found = inspect_file(file)
    missing = [line.partition(":")[0] for line in found.proposal.missing]
    assert missing == ["unit of time (t)", "unit of length (L)", "unit of force (F)", "f0", "pca"]
    assert "usual in s" in found.proposal.missing[0]
    assert not found.trials
    tree = yaml.safe_load(found.proposal.text)
    assert tree["columns"] == {"time": {"column": "t"}, "length": {"column": "L"}, "force": {"column": "F"}}
    filled = (
        found.proposal.text.replace("    # unit:  # fill in: one of s,", "    unit: s  # ")
        .replace("    # unit:  # fill in: one of m,", "    unit: mm  # ")
        .replace("    # unit:  # fill in: one of N,", "    unit: mN  # ")
        .replace("# f0:", "f0: 0.5 mN")
        .replace("# pca:", "pca: 6.1")
    )
    [event] = imports([file], filled, tmp_path / "out")
    assert event.trial.facts.pca == 6.1


def test_two_candidates_are_told_and_none_is_taken(tmp_path: Path) -> None:
    file = table(
        tmp_path / "a.csv",
        {"time_s": TIME_S, "length_mm": LENGTH_MM, "force A (mN)": FORCE_MN, "force B (mN)": FORCE_MN[::-1]},
    )
    found = inspect_file(file)
    assert "force" not in found.recognition.roles
    assert any(line.startswith("force: one of 'force A (mN)' or 'force B (mN)'") for line in found.proposal.missing)
    assert "may each be force" in report(found)
    assert "force" not in yaml.safe_load(found.proposal.text)["columns"]


def test_a_command_gives_way_to_what_was_measured_and_says_so(tmp_path: Path) -> None:
    file = table(tmp_path / "a.csv", {"Time (s)": TIME_S, "Lin (mm)": LENGTH_MM, "Lout (mm)": LENGTH_MM + 0.01})
    found = inspect_file(file)
    assert found.recognition.roles["length"].content.name == "Lin (mm)"
    assert any("'Lout (mm)' is taken for what was commanded" in line for line in found.recognition.remarks)


def test_a_name_and_a_unit_that_contradict_each_other_are_not_taken(tmp_path: Path) -> None:
    file = table(tmp_path / "a.csv", {"time_s": TIME_S, "length (deg)": LENGTH_MM, "force (W)": FORCE_MN})
    found = inspect_file(file)
    assert set(found.recognition.roles) == {"time"}
    assert "its unit 'W' is none (a power)" in found.recognition.taken_for["force (W)"]


def test_an_unknown_unit_of_a_named_signal_is_left_to_be_filled_in(tmp_path: Path) -> None:
    file = table(tmp_path / "a_pCa45.csv", {"time_s": TIME_S, "length_mm": LENGTH_MM, "force (lbf)": FORCE_MN})
    found = inspect_file(file)
    assert found.recognition.roles["force"].content.name == "force (lbf)"
    assert "its unit 'lbf' is not known" in found.recognition.taken_for["force (lbf)"]
    assert [line.partition(":")[0] for line in found.proposal.missing] == ["unit of force (force (lbf))", "f0"]
    assert "    # unit:  # fill in: one of N" in found.proposal.text
    assert not found.imports


@pytest.mark.parametrize("length", ["length_mm", "Length pCa {} (mm)", "L_pCa{} (mm)"])
@pytest.mark.parametrize("name", ["pCa {} (mN)", "Force pCa {} (mN)", "F_pCa{} [mN]"])
def test_a_column_for_each_pca_is_a_trial_each(tmp_path: Path, name: str, length: str) -> None:
    forces = {name.format(6.1): 0.5 * FORCE_MN, name.format(4.5): FORCE_MN}
    columns = {"time_s": TIME_S, length.format(6.1): LENGTH_MM, length.format(4.5): LENGTH_MM, **forces}
    file = table(tmp_path / "a.csv", columns, comments="# F0 = 0.5 mN\n")
    found = inspect_file(file)
    assert found.imports
    assert {found.recognition.taken_for[each] for each in forces} == {"force of a trial, whose pCa its name tells"}
    assert any("each of a trial" in line for line in found.proposal.guesses)
    events = imports([file], found.proposal.text, tmp_path / "out")
    assert [event.trial.facts.pca for event in events] == [6.1, 4.5]
    assert events[0].trial.force_n == pytest.approx(0.5e-3 * FORCE_MN, rel=1e-6)


def test_a_calcium_beside_columns_of_a_pca_each_is_left_out(tmp_path: Path) -> None:
    forces = {"pCa 6.1 (F0)": FORCE_MN, "pCa 4.5 (F0)": FORCE_MN}
    columns = {"time_s": TIME_S, "length_mm": LENGTH_MM, **forces, "pCa": np.full(400, 6.1)}
    found = inspect_file(table(tmp_path / "a.csv", columns))
    assert found.imports
    assert "'pCa' is left out, since the names of columns tell the pCa of each trial" in found.recognition.remarks


def test_columns_of_a_pca_without_words_or_units_are_force_of_an_unknown_unit(tmp_path: Path) -> None:
    forces = {"F_pCa61": FORCE_MN, "F_pCa45": FORCE_MN}
    found = inspect_file(table(tmp_path / "a.csv", {"time_s": TIME_S, "length_mm": LENGTH_MM, **forces}))
    assert found.proposal.tree["columns"]["force"]["factors"] == {"pca": 0.1}
    assert [line.partition(":")[0] for line in found.proposal.missing] == ["unit of force (F_pCa61)", "f0"]


@pytest.mark.parametrize(("names", "key"), [(("pCa9", "pCa6.2"), "file_name"), (("pCa62", "pCa4.5"), "per_file")])
def test_files_whose_names_tell_their_pca_differently(tmp_path: Path, names: tuple[str, str], key: str) -> None:
    columns = {"time_s": TIME_S, "length_mm": LENGTH_MM, "force (F0)": FORCE_MN}
    files = [table(tmp_path / f"run_{name}.csv", columns) for name in names]
    proposed = one_mapping([inspect_file(file) for file in files])
    assert key in proposed.tree
    assert not proposed.missing
    events = imports(files, proposed.text, tmp_path / "out")
    expected = [9.0, 6.2] if key == "file_name" else [6.2, 4.5]
    assert sorted(event.trial.facts.pca or 0.0 for event in events) == sorted(expected)


@pytest.mark.parametrize("name", ["Force_MG", "Force MG", "Force_G"])
def test_a_muscle_is_no_unit(tmp_path: Path, name: str) -> None:
    columns = {"time_s": TIME_S, "Length (mm)": LENGTH_MM, name: FORCE_MN}
    found = inspect_file(table(tmp_path / "a_pCa45.csv", columns))
    assert f"unit of force ({name})" in [line.partition(":")[0] for line in found.proposal.missing]


def test_passive_force_is_no_pressure(tmp_path: Path) -> None:
    columns = {"time_s": TIME_S, "Length (mm)": LENGTH_MM, "F_act": FORCE_MN, "F_pa": FORCE_MN}
    assert "force" not in inspect_file(table(tmp_path / "a_pCa45.csv", columns)).recognition.roles


def test_percent_beside_an_absolute_unit_tells_l0_and_f0(tmp_path: Path) -> None:
    relative = {"length (%L0)": 100.0 * LENGTH_MM / 1.2, "force (%F0)": 100.0 * FORCE_MN / 0.6}
    columns = {"time_s": TIME_S, "length_mm": LENGTH_MM, "force_mN": FORCE_MN, **relative}
    remarks = inspect_file(table(tmp_path / "a_pCa45.csv", columns)).recognition.remarks
    told = [float(line.rpartition(" is ")[2].split()[0]) for line in remarks]
    assert told == pytest.approx([1.2, 0.6], rel=1e-5)


def test_columns_of_pca_in_other_units_are_left_open(tmp_path: Path) -> None:
    forces = {"Force pCa 6.1 (mN)": FORCE_MN, "Force pCa 4.5 (uN)": FORCE_MN}
    found = inspect_file(table(tmp_path / "a.csv", {"time_s": TIME_S, "length_mm": LENGTH_MM, **forces}))
    assert set(found.recognition.unclear) == {"force"}


def test_a_column_that_holds_the_pca_it_is_called_by_is_calcium(tmp_path: Path) -> None:
    columns = {"time_s": TIME_S, "length_mm": LENGTH_MM, "force_mN": FORCE_MN, "pCa 6.1": np.full(400, 6.1)}
    found = inspect_file(table(tmp_path / "a.csv", columns))
    assert found.recognition.roles["calcium"].content.name == "pCa 6.1"


def test_grams_are_the_weight_of_a_mass(tmp_path: Path) -> None:
    file = table(tmp_path / "a_pCa45.csv", {"time_s": TIME_S, "length_mm": LENGTH_MM, "force (g)": FORCE_MN})
    found = inspect_file(file)
    assert found.proposal.tree["columns"]["force"]["unit"] == "g"
    assert [line.partition(":")[0] for line in found.proposal.missing] == ["f0"]


def test_lengths_below_zero_are_a_change(tmp_path: Path) -> None:
    file = table(tmp_path / "a_pCa45.csv", {"time_s": TIME_S, "length_mm": LENGTH_MM - 1.22})
    found = inspect_file(file)
    assert found.proposal.tree["columns"]["length"]["is"] == "change"
    assert [line.partition(":")[0] for line in found.proposal.missing] == ["reference_length"]


def test_one_signal_in_two_units_tells_its_scale(tmp_path: Path) -> None:
    columns = {
        "time_s": TIME_S,
        "length_mm": LENGTH_MM,
        "length_change_l0": LENGTH_MM / 1.2 - 1.0,
        "force_mN": FORCE_MN,
        "force_f0": FORCE_MN / 0.5,
    }
    found = inspect_file(table(tmp_path / "a_pCa6.csv", columns))
    assert found.imports
    assert found.trials[0].facts.f0_n == pytest.approx(0.5e-3, rel=1e-6)
    assert found.trials[0].facts.reference_length_m == pytest.approx(1.2e-3, rel=1e-6)


def test_facts_of_lengths_in_l0_and_forces_in_f0_scale_them(tmp_path: Path) -> None:
    columns = {"time_s": TIME_S, "length (L0)": LENGTH_MM / 1.2, "force (F0)": FORCE_MN / 0.5}
    facts = inspect_file(table(tmp_path / "a_pCa6.csv", columns, comments="# L0 = 1.2 mm\n# F0: 0.5 mN\n"))
    assert (facts.trials[0].facts.reference_length_m, facts.trials[0].facts.f0_n) == pytest.approx((1.2e-3, 5e-4))
    plain = inspect_file(table(tmp_path / "b_pCa6.csv", columns, comments="# F0: 97 kPa\n"))
    assert (plain.trials[0].facts.reference_length_m, plain.trials[0].facts.f0_n) == (1.0, 1.0)
    assert "# reference_length:  # may be filled in: how long one L0 is" in plain.proposal.text


def test_faults_of_cells_and_clocks_are_placed(tmp_path: Path) -> None:
    times = TIME_S.copy()
    times[50:] += 0.3
    times[120] = times[119]
    file = table(tmp_path / "a_pCa6.csv", {"time_s": times, "length_mm": LENGTH_MM})
    text = file.read_text().splitlines()
    text[10] = text[10].partition(",")[0] + ","
    file.write_text("\n".join(text))
    told = report(inspect_file(file))
    assert "1 cell is empty, the first in line 11" in told
    assert "time stands still 1 times, first at line 122" in told
    assert "Refused by an import" in told


def test_units_below_the_header_are_read_and_told(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text("time,length,force\n(s),(mm),(mN)\n" + "".join(f"{i / 1000},1.2,0.3\n" for i in range(50)))
    found = inspect_file(file)
    assert {role: one.unit for role, one in found.recognition.roles.items()} == {
        "time": "s", "length": "mm", "force": "mN",
    }  # fmt: skip
    assert "line 2 holds units" in report(found)


def test_a_workbook_is_inspected_as_a_table_is(tmp_path: Path) -> None:
    book = pytest.importorskip("openpyxl").Workbook()
    sheet = book.active
    sheet.append(["Time (s)", "Length (mm)", "Force (mN)"])
    for row in zip(TIME_S.tolist(), LENGTH_MM.tolist(), FORCE_MN.tolist(), strict=True):
        sheet.append(row)
    book.save(tmp_path / "a_pCa6.xlsx")
    found = inspect_file(tmp_path / "a_pCa6.xlsx")
    assert {role: one.unit for role, one in found.recognition.roles.items()} == {
        "time": "s", "length": "mm", "force": "mN",
    }  # fmt: skip
    assert [line.partition(":")[0] for line in found.proposal.missing] == ["f0"]


def test_files_of_one_layout_share_a_mapping_and_keep_what_each_tells(tmp_path: Path) -> None:
    columns = {"time_s": TIME_S, "length_mm": LENGTH_MM, "force_mN": FORCE_MN}
    files = [
        table(tmp_path / f"run{i}.csv", columns, comments=f"# fibre: mine\n# pca: {pca}\n# f0: 0.5 mN\n")
        for i, pca in enumerate((4.5, 6.1))
    ]
    mapping = one_mapping([inspect_file(file) for file in files])
    assert not mapping.missing
    events = imports(files, mapping.text, tmp_path / "out")
    assert [event.trial.facts.pca for event in events] == [4.5, 6.1]
    other = table(tmp_path / "other.csv", {"time_s": TIME_S, "length_m": LENGTH_MM * 1e-3})
    with pytest.raises(UserError, match="different signals"):
        one_mapping([inspect_file(file) for file in (files[0], other)])


def test_a_bag_of_this_package_is_what_replay_takes_it_for(tmp_path: Path) -> None:
    trial = StretchShortenStretch(0.0383, 0.1).trial("mine", 6.1)
    write_trial(tmp_path / "bag", trial)
    found = inspect_file(tmp_path / "bag")
    assert found.is_own
    assert found.trials[0].facts == read_trial(tmp_path / "bag").facts
    assert "needs no import" in report(found)
    assert {row["signal"]: row["role"] for row in rows(found)} == {
        "/muscle/calcium position[mine]": "calcium", "/muscle/length position[mine]": "length",
    }  # fmt: skip
    assert draw(tmp_path / "p.png", found) is not None


TEXTS = st.text(st.characters(codec="utf-8"), max_size=8) | st.sampled_from(["time_s", "L", "F$^$"])
NAMES = {
    "time": [("Time (s)", 1.0), ("zeit_ms", 1e3), ("t [s]", 1.0), ("temps / ms", 1e3)],
    "length": [("Length (mm)", 1.0), ("Länge_mm", 1.0), ("position [um]", 1e3), ("fibre length, m", 1e-3)],
    "force": [("Force (mN)", 1.0), ("kraft_mN", 1.0), ("Fin / N", 1e-3), ("fuerza [uN]", 1e3)],
    "calcium": [("calcium_um", 1.0), ("free Ca (nM)", 1e3)],
}


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    chosen=st.tuples(*(st.sampled_from(names) for names in NAMES.values())),
    order=st.permutations(range(4)),
    delimiter=st.sampled_from(["\t", ";"]),
)
def test_whatever_the_names_units_and_order_the_trial_is_the_same(
    tmp_path: Path, chosen: tuple[tuple[str, float], ...], order: list[int], delimiter: str
) -> None:
    values = (TIME_S, LENGTH_MM, FORCE_MN, np.full(TIME_S.size, 0.8))
    columns = {chosen[i][0]: values[i] * chosen[i][1] for i in order}
    found = inspect_file(table(tmp_path / "a.csv", columns, delimiter, "# f0: 0.5 mN\n"))
    assert found.imports, report(found)
    trial = found.trials[0]
    np.testing.assert_allclose(trial.time_s, TIME_S, atol=1e-9)
    np.testing.assert_allclose(trial.length_m, LENGTH_MM * 1e-3, rtol=1e-7)
    np.testing.assert_allclose(trial.force_n, FORCE_MN * 1e-3, rtol=1e-7)
    assert trial.facts.pca == pytest.approx(6.0 - np.log10(0.8), abs=1e-6)


def test_a_column_of_time_without_a_time_is_told(tmp_path: Path) -> None:
    """It ended in an IndexError."""
    file = tmp_path / "a.csv"
    file.write_text("\tTIME\n0.0", encoding="utf-8")
    found = inspect_file(file)
    assert not found.imports
    assert "no time is a finite number" in report(found)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    header=st.lists(
        TEXTS,
        min_size=1,
        max_size=4,
    ),
    rows_of=st.lists(
        st.lists(st.one_of(st.floats().map(str), st.text(max_size=3)), min_size=1, max_size=4), max_size=6
    ),
)
def test_any_table_is_told_or_refused_on_one_line(tmp_path: Path, header: list[str], rows_of: list[list[str]]) -> None:
    file = tmp_path / "a.csv"
    text = "\n".join("\t".join(row) for row in (header, *rows_of))
    file.write_text(text, encoding="utf-8", errors="surrogateescape", newline="")
    try:
        found = inspect_file(file)
    except UserError:
        return
    assert isinstance(yaml.safe_load(found.proposal.text), dict)
    assert report(found)
    draw(tmp_path / "p.png", found)


def test_of_a_long_signal_peaks_and_gaps_are_drawn() -> None:
    values = np.zeros(100_000)
    values[[31_111, 77_777]] = 1.0, -2.0
    values[50_000:50_010] = np.nan
    shown = values[_drawn(values)]
    assert shown.size < 10_000
    assert (np.nanmax(shown), np.nanmin(shown)) == (1.0, -2.0)
    assert np.isnan(shown).any()
    assert values[_drawn(values[:50])].size == values.size
    assert np.isnan(values[50_000:50_010][_drawn(values[50_000:50_010])]).all()
