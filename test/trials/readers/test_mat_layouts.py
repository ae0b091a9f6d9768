"""MATLAB files of any layout, saved as version 7 and as 7.3: both have to give the same."""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mat73 import Text, h5py, save73
from scipy.io import savemat

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.assembly import trial_of
from xb_muscle_ros.trials.readers.mat_file import load
from xb_muscle_ros.trials.readers.mat_path import MatPath
from xb_muscle_ros.trials.readers.registry import reader_for
from xb_muscle_ros.trials.readers.settings import ImportSettings, MappingError
from xb_muscle_ros.trials.trial import Trial

Save = Callable[[Path, dict[str, Any]], Path]
COUNT = 200
TIME = np.arange(COUNT) / 1000
LENGTH = 10.0 + np.interp(TIME, [0.05, 0.1], [0.0, 0.5])
FORCE = 5.0 + 10.0 * TIME
COLUMNS = {
    "time": {"column": "time", "unit": "s"},
    "length": {"column": "length", "unit": "mm"},
    "force": {"column": "force", "unit": "mN"},
}
FACTS: dict[str, Any] = {"pca": 4.5, "f0": "10 mN"}


def save7(path: Path, variables: dict[str, Any]) -> Path:
    """As version 7, where cells are arrays of objects and vectors columns."""

    def converted(value: Any) -> Any:
        if isinstance(value, list):
            made = np.empty((len(value), 1), dtype=object)
            for i, each in enumerate(value):
                made[i, 0] = converted(each)
            return made
        return {key: converted(each) for key, each in value.items()} if isinstance(value, dict) else value

    savemat(path, converted(variables), do_compression=True, oned_as="column")
    return path


@pytest.fixture(params=[save7, save73])
def save(request: pytest.FixtureRequest) -> Save:
    """One of the two versions."""
    made: Save = request.param
    return made


def columns(**paths: str) -> dict[str, Any]:
    return {key: {**COLUMNS[key], "column": paths.get(key, COLUMNS[key]["column"])} for key in COLUMNS}


def read(path: Path, **keys: Any) -> dict[str, Trial]:
    prepared = ImportSettings({**FACTS, **keys}, "here").prepare(path)
    return {
        pending.trial: trial_of(pending.read(), prepared.mapping, path)
        for pending in prepared.reader.trials(path, prepared.mapping)
    }


def structs(*fields: dict[str, Any]) -> np.ndarray:
    """An array of structs."""
    made = np.empty((1, len(fields)), dtype=[(name, object) for name in fields[0]])
    for i, each in enumerate(fields):
        for name, value in each.items():
            made[0, i][name] = value
    return made


def scaled(factor: float, count: int = COUNT) -> dict[str, np.ndarray]:
    return {"time": TIME[:count], "length": LENGTH[:count], "force": factor * FORCE[:count]}


def check(trial: Trial, factor: float = 1.0, count: int = COUNT) -> None:
    assert trial.time_s == pytest.approx(TIME[:count])
    assert trial.length_m == pytest.approx(LENGTH[:count] / 1000)
    assert trial.force_n == pytest.approx(factor * FORCE[:count] / 1000)
    assert (trial.facts.pca, trial.facts.f0_n) == (4.5, 0.01)


def test_variables_in_the_root(tmp_path: Path, save: Save) -> None:
    (trial,) = read(save(tmp_path / "f.mat", scaled(1.0)), columns=COLUMNS).values()
    check(trial)
    assert (trial.facts.fibre, trial.facts.trial, trial.warnings) == ("f", "f", ())


def test_usual_names_and_units_beside_them_need_no_mapping(tmp_path: Path, save: Save) -> None:
    units = {"time_unit": "msec", "length_units": "[mm]", "units": {"force": "mN"}}
    content = {"Time": 1000 * TIME, "length": LENGTH, "force": FORCE, **units}
    content["Time_unit"] = content.pop("time_unit")
    (trial,) = read(save(tmp_path / "f.mat", content)).values()
    check(trial)
    (line,) = trial.warnings
    assert "units are those of the file: time in ms, length in mm, force in mN" in line


def test_strings_of_matlab_are_text(tmp_path: Path) -> None:
    trials = structs({**scaled(1.0), "name": Text("up µ")}, {**scaled(2.0), "name": Text("down")})
    path = save73(tmp_path / "f.mat", {"trials": trials, "units": {"length": Text("mm"), "force": Text("mN")}})
    assert load(path)["units"] == {"length": "mm", "force": "mN"}
    mapping = {key: {"column": f"trials.{key}"} for key in ("length", "force")}
    mapping |= {"time": {"column": "trials.time", "unit": "s"}, "trial": {"column": "trials.name"}}
    assert list(read(path, columns=mapping)) == ["f_up µ", "f_down"]


def test_the_mappings_unit_goes_before_the_files(tmp_path: Path, save: Save) -> None:
    content = {**scaled(1000.0), "force_unit": "mN"}
    (trial,) = read(
        save(tmp_path / "f.mat", content), columns={**COLUMNS, "force": {"column": "force", "unit": "uN"}}
    ).values()
    check(trial)
    (line,) = (line for line in trial.warnings if "mapping's is used" in line)
    assert "f.mat: the file says mN of force, the mapping uN" in line


@pytest.mark.parametrize(("unit", "is_told"), [("mN", True), ("0.5 mN/mV", True), ("0.5 mN/V", False)])
def test_volts_that_are_read_as_something_else_are_told(tmp_path: Path, save: Save, unit: str, is_told: bool) -> None:
    """Regression: volts beside the numbers were passed over where the mapping gave newtons."""
    content = {**scaled(1000.0), "force_unit": "V"}
    columns = {**COLUMNS, "force": {"column": "force", "unit": unit}}
    (trial,) = read(save(tmp_path / "f.mat", content), columns=columns, f0="10 N").values()
    told = [line for line in trial.warnings if "the file says V of force" in line]
    assert len(told) == is_told
    assert all("give what one V stands for, for example '0.5 mN/V'" in line for line in told)


@pytest.mark.parametrize("name", ["values", "data"])
def test_a_struct_for_each_channel_has_its_unit(tmp_path: Path, save: Save, name: str) -> None:
    content = {
        "clock": {name: 1000 * TIME, "unit": "ms"},
        "motor": {name: LENGTH, "units": "mm"},
        "cell": {name: FORCE, "units": "mN"},
    }
    found = dict(zip(COLUMNS, content, strict=True))
    path = save(tmp_path / "f.mat", content)
    (trial,) = read(path, columns={key: {"column": f"{each}.{name}"} for key, each in found.items()}).values()
    check(trial)


def test_a_unit_of_the_file_that_is_not_known_is_one_line(tmp_path: Path, save: Save) -> None:
    path = save(tmp_path / "f.mat", {**scaled(1.0), "force_unit": "lbf"})
    with pytest.raises(UserError, match=r"f\.mat: force: unit 'lbf' of force is not known.*--force-unit"):
        read(path, columns={**COLUMNS, "force": {"column": "force"}})


def test_matrix_with_a_column_for_each_signal(tmp_path: Path, save: Save) -> None:
    path = save(tmp_path / "f.mat", {"data": np.column_stack([TIME, LENGTH, FORCE])})
    (trial,) = read(path, columns=columns(time="data(:,1)", length="data(:,2)", force="data(:,3)")).values()
    check(trial)


@pytest.mark.parametrize(("turn", "index"), [(False, "(trial,:)"), (True, "(:,trial)")])
def test_a_row_or_a_column_for_each_trial(tmp_path: Path, save: Save, turn: bool, index: str) -> None:
    force = np.array([FORCE, 2 * FORCE, 3 * FORCE])
    force[1, 150:] = np.nan  # a short trial is filled up
    length = np.array([LENGTH] * 3)
    length[1, 150:] = np.nan
    turned = {"force": force.T, "length": length.T} if turn else {"force": force, "length": length}
    path = save(tmp_path / "f.mat", {"time": TIME, **turned})
    trials = read(path, columns=columns(length=f"length{index}", force=f"force{index}"))
    assert list(trials) == ["f_1", "f_2", "f_3"]
    check(trials["f_1"])
    check(trials["f_2"], 2.0, 150)
    check(trials["f_3"], 3.0)


def test_cells_of_trials_run_over_them(tmp_path: Path, save: Save) -> None:
    content = {"time": [TIME, TIME], "length": [LENGTH, LENGTH], "force": [FORCE, 2 * FORCE]}
    trials = read(save(tmp_path / "f.mat", content), columns=COLUMNS)
    check(trials["f_1"])
    check(trials["f_2"], 2.0)


def test_array_of_structs_with_names_and_calcium(tmp_path: Path, save: Save) -> None:
    content = structs(
        {**scaled(1.0), "pCa": np.array([4.5]), "name": "up"}, {**scaled(2.0), "pCa": np.array([4.5]), "name": "down"}
    )
    mapping = {
        **{key: {**each, "column": f"exp.trials.{each['column']}"} for key, each in COLUMNS.items()},
        "calcium": {"column": "exp.trials.pCa", "unit": "pCa"},
        "trial": {"column": "exp.trials.name"},
    }
    path = save(tmp_path / "f.mat", {"exp": {"trials": content, "notes": "of the day"}})
    prepared = ImportSettings({"f0": "10 mN", "columns": mapping}, "here").prepare(path)
    trials = {
        each.trial: trial_of(each.read(), prepared.mapping, path)
        for each in prepared.reader.trials(path, prepared.mapping)
    }
    assert list(trials) == ["f_up", "f_down"]
    check(trials["f_up"])
    check(trials["f_down"], 2.0)


def test_one_of_the_trials_by_its_number(tmp_path: Path, save: Save) -> None:
    path = save(tmp_path / "f.mat", {"trials": structs(scaled(1.0), scaled(2.0))})
    (trial,) = read(path, columns=columns(**{key: f"trials(2).{key}" for key in COLUMNS})).values()
    check(trial, 2.0)


def test_cells_of_structs_and_one_by_its_number(tmp_path: Path, save: Save) -> None:
    path = save(tmp_path / "f.mat", {"trials": [scaled(1.0), scaled(2.0, 150)]})
    trials = read(path, columns=columns(**{key: f"trials{{trial}}.{key}" for key in COLUMNS}))
    check(trials["f_1"])
    check(trials["f_2"], 2.0, 150)
    (trial,) = read(path, columns=columns(**{key: f"trials{{2}}.{key}" for key in COLUMNS})).values()
    check(trial, 2.0, 150)


def test_trials_that_are_empty_are_left_out_with_a_line(tmp_path: Path, save: Save) -> None:
    nothing = {"time": np.empty((0, 0)), "length": np.empty((0, 0)), "force": np.empty((0, 0))}
    trials = read(
        save(tmp_path / "f.mat", {"trials": [scaled(1.0), nothing, scaled(3.0)]}),
        columns=columns(**{key: f"trials.{key}" for key in COLUMNS}),
    )
    assert list(trials) == ["f_1", "f_3"]
    check(trials["f_3"], 3.0)
    (line,) = trials["f_1"].warnings
    assert line.endswith("were not measured and are left out: 2")


def test_rate_or_step_in_place_of_times(tmp_path: Path, save: Save) -> None:
    content = {"length": LENGTH, "force": FORCE, "dt": np.array([1.0])}
    path = save(tmp_path / "f.mat", content)
    (trial,) = read(path, columns={**COLUMNS, "time": {"rate": "1000 Hz"}}).values()
    check(trial)
    (trial,) = read(path, columns={**COLUMNS, "time": {"column": "dt", "unit": "ms"}}).values()
    check(trial)
    assert "dt is one number, 1 ms, taken as the time between samples" in trial.warnings[0]


def test_integers_and_logicals_are_numbers(tmp_path: Path, save: Save) -> None:
    content = {"time": TIME, "length": LENGTH, "force": np.arange(COUNT, dtype=np.int16) // 2}
    (trial,) = read(save(tmp_path / "f.mat", content), columns=COLUMNS).values()
    assert trial.force_n == pytest.approx(np.arange(COUNT) // 2 / 1000)


@pytest.mark.parametrize(
    ("content", "paths", "words"),
    [
        ({"x": FORCE}, None, "columns.length has to name a variable (--length-column); the file holds x (200 x 1)"),
        (scaled(1.0), {"force": "forse"}, "there is no variable 'forse'; did you mean 'force'?; it holds"),
        ({**scaled(1.0), "s": {"a": FORCE}}, {"force": "s.b"}, "s has no field 'b'; known: a; it holds a (200 x 1)"),
        ({**scaled(1.0), "s": {"a": FORCE}}, {"force": "s"}, "s is a struct; needed are numbers; name a field"),
        ({**scaled(1.0), "s": "text"}, {"force": "s"}, "s is text; needed are numbers"),
        ({**scaled(1.0), "s": "text"}, {"force": "s.a"}, "s has no fields, so there is no 's.a'"),
        (
            {**scaled(1.0), "m": np.ones((COUNT, 3))},
            {"force": "m"},
            "m is 200 x 3; needed is one row or column; 'm(:,1)'",
        ),
        (
            {**scaled(1.0), "m": np.ones((COUNT, 3))},
            {"force": "m(:,4)"},
            "asks for number 4 of 3 (its shape is 200 x 3)",
        ),
        ({**scaled(1.0), "m": np.ones((COUNT, 3))}, {"force": "m(:,1,2)"}, "m is 200 x 3; 'm(:,1,2)' has 3 indices"),
        (
            {**scaled(1.0), "m": [FORCE] * 3, "n": [TIME] * 2},
            {"force": "m", "time": "n"},
            "n runs over 2 trials, m over 3",
        ),
        ({**scaled(1.0), "m": FORCE[:9]}, {"force": "m"}, "length has 200 samples, m 9; needed are equal numbers"),
        (scaled(1.0), {"force": "force(0)"}, "index '0' is none; allowed are numbers from 1, ':' and 'trial'"),
        (scaled(1.0), {"force": "force("}, "column 'force(' is no path into a MATLAB file"),
        (scaled(1.0), {"force": "force(trial,trial)"}, "has 'trial' twice"),
    ],
)
def test_what_does_not_fit_is_told_in_one_line(
    tmp_path: Path, save: Save, content: dict[str, Any], paths: dict[str, str] | None, words: str
) -> None:
    path = save(tmp_path / "f.mat", content)
    with pytest.raises(UserError) as refused:
        read(path, **({} if paths is None else {"columns": columns(**paths)}))
    assert words in str(refused.value)


def test_a_missing_unit_is_asked_for(tmp_path: Path, save: Save) -> None:
    with pytest.raises(MappingError, match=r"columns\.time: unit is missing; give the unit of column 'time'"):
        read(save(tmp_path / "f.mat", scaled(1.0)))


def test_without_h5py_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = save73(tmp_path / "f.mat", scaled(1.0))
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(UserError, match=r"f\.mat is a MATLAB 7\.3 file, which needs h5py.*xb_muscle_ros\[files\]"):
        read(path, columns=COLUMNS)


def test_text_of_octave_is_told(tmp_path: Path) -> None:
    path = tmp_path / "f.mat"
    path.write_text("# Created by Octave 8.4.0, Mon Nov 30 10:00:00 2026 UTC\n# name: force\n")
    with pytest.raises(UserError, match=r"is text of Octave; .* save it with save\('-v7', \.\.\.\)"):
        read(path, columns=COLUMNS)


def test_contents_are_vectors_columns_and_what_is_no_signal(tmp_path: Path, save: Save) -> None:
    many = structs({"force": FORCE, "name": "a"}, {"force": 2 * FORCE, "name": "b"})
    content = {"data": np.column_stack([TIME, LENGTH]), "trials": many, "units": {"force": "mN"}, "n": np.array([7.0])}
    path = save(tmp_path / "f.mat", content)
    found = reader_for(path).contents(path)
    signals = {each.name: each for each in found.signals}
    assert list(signals) == ["data(:,1)", "data(:,2)", "trials.force"]
    assert signals["data(:,2)"].values == pytest.approx(LENGTH)
    assert (signals["trials.force"].unit, signals["trials.force"].values[0]) == ("mN", 5.0)
    assert found.trials == ("1", "2")
    assert {"trials.name: text 'a'", "n: 7"} <= set(found.others)


@pytest.mark.parametrize(
    ("content", "names", "others"),
    [
        ({"force": [FORCE, 2 * FORCE], "pCa": [[4.5], [6.1]]}, ("force(:,trial)", "pCa(trial)"), ()),
        ({"force": [FORCE, 2 * FORCE], "pCa": [[4.5]]}, ("force(:,trial)", "pCa"), ()),
        ({"Data": [FORCE, 2 * FORCE], "n": [[4.5], [6.1]]}, ("Data(:,1)", "Data(:,2)", "n"), ()),
        ({"force": [FORCE, 2 * FORCE], "n": [[4.5]]}, ("force(:,trial)",), ("n: 4.5",)),
    ],
)
def test_trials_in_matrices_and_their_pca(
    tmp_path: Path, save: Save, content: dict[str, Any], names: tuple[str, ...], others: tuple[str, ...]
) -> None:
    arrays = {name: np.array(rows).T if len(rows[0]) > 1 else np.array(rows) for name, rows in content.items()}
    found = reader_for(path := save(tmp_path / "f.mat", {"time": TIME, **arrays})).contents(path)
    assert ({each.name for each in found.signals}, found.others) == ({"time", *names}, others)
    turned = {name: values.T for name, values in arrays.items() if name == "force"}
    found = reader_for(path := save(tmp_path / "g.mat", {"time": TIME, **arrays, **turned})).contents(path)
    assert [each.name for each in found.signals if each.name.startswith("force")] == ["force(trial,:)"] * len(turned)


def test_a_matrix_whose_first_column_is_time_is_no_trials(tmp_path: Path, save: Save) -> None:
    path = save(tmp_path / "f.mat", {"force": np.column_stack([TIME, LENGTH, FORCE])})
    assert [each.name for each in reader_for(path).contents(path).signals] == [f"force(:,{i})" for i in (1, 2, 3)]


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ({"pCa": np.array([[4.5], [6.1]])}, "trial f_2: pCa(trial) holds 6.1, but pCa is given as 4.5"),
        ({"pCa": np.array([[6.1]])}, "trial f_1: pCa holds 6.1, but pCa is given as 4.5"),
        ({"pca": np.full((COUNT, 1), 6.1)}, "trial f_1: pca holds 6.1, but pCa is given as 4.5"),
        ({"pCa": np.array([[4.5], [4.51]])}, ""),
        ({"pCa": np.array([[4.5], [6.1], [7.0]]), "pCaX": np.array([[6.1]])}, ""),
        ({"pCa": np.array([[100.0]])}, ""),
        ({"other": {"pCa": np.array([[6.1]])}}, ""),
    ],
)
def test_a_variable_that_tells_another_pca_is_refused(
    tmp_path: Path, save: Save, content: dict[str, Any], told: str
) -> None:
    path = save(
        tmp_path / "f.mat", {"time": TIME, "length": LENGTH, "force": np.array([FORCE, 2 * FORCE]).T, **content}
    )
    keys = columns(force="force(:,trial)")
    if told:
        with pytest.raises(UserError, match=re.escape(told) + ".*--calcium-column"):
            read(path, columns=keys)
    else:
        assert [trial.facts.pca for trial in read(path, columns=keys).values()] == [4.5, 4.5]


def test_a_field_that_tells_another_pca_is_refused(tmp_path: Path, save: Save) -> None:
    fields = {"time": TIME, "length": LENGTH, "force": FORCE}
    path = save(tmp_path / "f.mat", {"trials": structs(*({**fields, "pCa": np.array([pca])} for pca in (4.5, 6.1)))})
    keys = columns(**{name: f"trials.{name}" for name in fields})
    with pytest.raises(UserError, match=r"trial f_2: trials\.pCa holds 6\.1, .* --calcium-column 'trials\.pCa'"):
        read(path, columns=keys)
    trials = read(path, pca=None, columns={**keys, "calcium": {"column": "trials.pCa", "unit": "pCa"}})
    assert [trial.facts.pca for trial in trials.values()] == [4.5, 6.1]


@pytest.mark.parametrize("writer", [save7, save73])
def test_content_is_the_same_in_both_versions(tmp_path: Path, writer: Save) -> None:
    content = {
        "m": np.arange(6.0).reshape(2, 3),
        "c": ["a", np.array([1.0, 2.0])],
        "s": structs({"a": "x"}, {"a": "y"}),
    }
    found = load(writer(tmp_path / "f.mat", {**content, "q": {"e": np.empty((0, 0)), "b": np.array([True, False])}}))
    assert found["m"].tolist() == [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]
    assert found["c"].ravel()[0] == "a"
    assert found["c"].ravel()[1].tolist() == [[1.0], [2.0]]
    assert [each["a"] for each in found["s"].ravel()] == ["x", "y"]
    assert found["q"]["e"].size == 0
    assert found["q"]["b"].tolist() == [[1.0], [0.0]]


def test_names_that_are_no_text_and_lost_parts_are_damage(tmp_path: Path) -> None:
    path = save73(tmp_path / "f.mat", {"trials": {**scaled(1.0)}})
    whole = path.read_bytes()
    path.write_bytes(whole.replace(b"force\x00", b"\xffoo\xffe\x00"))
    mapping = columns(**{key: f"trials.{key}" for key in COLUMNS})
    with pytest.raises(UserError, match=r"no whole MATLAB file \(names in /trials are no text\)"):
        read(path, columns=mapping)
    path.write_bytes(whole)
    with h5py.File(path, "r+") as file:  # room for a record that was never written
        del file["trials/force"]
        made = file["trials"].create_dataset("force", shape=(1, COUNT), chunks=(1, COUNT // 2), dtype="f8")
        made[0, : COUNT // 2] = FORCE[: COUNT // 2]
    with pytest.raises(UserError, match=r"no whole MATLAB file \(parts of /trials/force are not there\)"):
        read(path, columns=mapping)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_files_are_refused_or_read_whole(tmp_path: Path, data: st.DataObject) -> None:
    writer = data.draw(st.sampled_from([save7, save73]))
    path = writer(tmp_path / "f.mat", {"trials": structs(scaled(1.0), scaled(2.0)), "unit": "mN"})
    content = bytearray(path.read_bytes())
    if data.draw(st.booleans()):
        content = content[: data.draw(st.integers(0, len(content) - 1))]
    else:
        for _ in range(data.draw(st.integers(1, 4))):
            content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content)
    trials = {}
    with contextlib.suppress(UserError):
        trials = read(path, columns=columns(**{key: f"trials.{key}" for key in COLUMNS}))
    for trial in trials.values():
        assert np.isfinite(trial.force_n).all()
        assert trial.force_n.size == trial.time_s.size == COUNT


@given(st.text(alphabet="ab.(){}:,1 trial", max_size=20))
def test_any_path_is_read_or_refused(text: str) -> None:
    content = {"a": np.ones((3, 2)), "b": {"a": "t"}}
    with contextlib.suppress(UserError):
        assert MatPath(text, "here").numbers(content, 0, "file").ndim == 1
