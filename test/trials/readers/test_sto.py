"""OpenSim's storage and motion files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from changes import swap
from hypothesis import given, settings
from hypothesis import strategies as st

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.importing import Imported, find_recordings, import_recordings
from xb_muscle_ros.trials.readers.assembly import trial_of
from xb_muscle_ros.trials.readers.registry import READERS, reader_for
from xb_muscle_ros.trials.readers.settings import ImportSettings, MappingError
from xb_muscle_ros.trials.trial import Trial

COUNT = 200
TIME_S = np.arange(COUNT) / 1000.0
LENGTH_M = 0.05 * np.interp(TIME_S, [0.05, 0.1], [1.0, 1.04])
FORCE_N = 300.0 + 1000.0 * (LENGTH_M / 0.05 - 1.0)
NAMES = ("time", "soleus_r/fiber_length", "soleus_r/force")


def sto(
    path: Path,
    names: tuple[str, ...] = NAMES,
    gap: str = "\t",
    end: str = "\n",
    told: dict[str, str] | None = None,
    scale: float = 1.0,
    force: float = 1.0,
) -> Path:
    """A file as OpenSim writes them; ``told`` changes the header, 'None' takes a line out."""
    facts = {"version": "3", "OpenSimVersion": "4.5", "inDegrees": "no", "nRows": str(COUNT), "nColumns": "3"}
    lines = ["forces", *(f"{key}={value}" for key, value in {**facts, **(told or {})}.items() if value != "None")]
    lines += ["endheader", "\t".join(names)]
    columns = zip(TIME_S, LENGTH_M, force * FORCE_N, strict=True)
    lines += [gap.join((f"{t:.8f}", f"{scale * x:.10f}", f"{f:.8f}")) for t, x, f in columns]
    path.write_bytes(end.join([*lines, ""]).encode())
    return path


KEYS: dict[str, Any] = {
    "columns": {"length": {"column": NAMES[1]}, "force": {"column": NAMES[2]}},
    "f0": "1000 N",
    "pca": 5.5,
}


def read(path: Path, file_format: str | None = None, **keys: Any) -> Trial:
    prepared = ImportSettings({**KEYS, **keys}, "here", file_format).prepare(path)
    (pending,) = prepared.reader.trials(path, prepared.mapping)
    return trial_of(pending.read(), prepared.mapping, path)


@pytest.mark.parametrize("name", ["walk.sto", "walk.mot"])
@pytest.mark.parametrize("gap", ["\t", "  "])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_columns_come_in_si_units(tmp_path: Path, name: str, gap: str, end: str) -> None:
    trial = read(sto(tmp_path / name, gap=gap, end=end))
    assert (trial.facts.fibre, trial.facts.trial, trial.facts.f0_n) == ("walk", "walk", 1000.0)
    assert trial.time_s == pytest.approx(TIME_S, abs=1e-9)
    assert trial.length_m == pytest.approx(LENGTH_M, abs=1e-10)
    assert trial.force_n == pytest.approx(FORCE_N, abs=1e-8)
    assert trial.facts.reference_length_m == pytest.approx(0.05, rel=1e-6)
    assert [phase.name for phase in trial.facts.phases] == ["isometric", "test_stretch", "hold"]
    assert "OpenSim storage forces" in trial.facts.source
    assert trial.warnings == ()


def test_what_a_mapping_has_to_tell(tmp_path: Path) -> None:
    file = sto(tmp_path / "a.sto")
    with pytest.raises(MappingError, match=r"columns\.length: column is missing; name the column"):
        read(file, columns={})
    assert read(file, columns={"length": {"column": NAMES[1]}}, f0=None).force_n.size == 0
    percent = {"length": {"column": NAMES[1], "unit": "mm"}, "force": {"column": NAMES[2], "unit": "mN"}}
    assert read(file, columns=percent, f0="1 N").length_m[0] == pytest.approx(5e-5)


def test_rows_that_are_not_as_many_as_told_are_told(tmp_path: Path) -> None:
    (warning,) = read(sto(tmp_path / "a.sto", told={"nRows": "300"})).warnings
    assert "has 200 rows, its header tells of 300; the file was cut short; the rows are used" in warning
    (warning,) = read(sto(tmp_path / "a.sto", told={"nRows": "100"})).warnings
    assert "rows were added" in warning
    assert read(sto(tmp_path / "a.sto", told={"nRows": "None", "nColumns": "None"})).warnings == ()
    old = sto(tmp_path / "old.mot", told={"nRows": "None", "nColumns": "None"})
    old.write_text(old.read_text().replace("forces\n", "name forces\ndatacolumns 3\ndatarows 199\n"))
    (warning,) = read(old).warnings
    assert "its header tells of 199" in warning


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: "", "is empty; needed is a storage file of OpenSim"),
        (swap("endheader\n", ""), "has no line 'endheader'"),
        (lambda text: text[: text.index("time")], "no columns are named below 'endheader'"),
        (lambda text: text[: text.index("0.00000000")], "has no whole rows below its header"),
        (swap("nColumns=3", "nColumns=4"), "names 3 columns, the header tells of 4"),
        (swap("0.00500000\t", "0.00500000\tx"), "column 'soleus_r/fiber_length' holds 'x0.05"),
        (swap("0.00500000\t", "0.00500000\t1\t"), "has 4 cells; needed are 3: time, soleus_r"),
        (swap("0.00500000\t", "0.00400000\t"), "column 'time': 0.004 s does not come after 0.004 s"),
        (swap("soleus_r/force", "soleus_r/fiber_length"), "has more than one column 'soleus_r/fiber_length'"),
        (
            swap("soleus_r/force", "gastroc/force"),
            "has no column 'soleus_r/force'; its columns: time, soleus_r/fiber",
        ),
    ],
)
def test_what_is_broken_is_told_in_one_line(tmp_path: Path, change: Callable[[str], str], words: str) -> None:
    file = sto(tmp_path / "trial.sto")
    file.write_text(change(file.read_text()))
    with pytest.raises(UserError) as refused:
        read(file)
    assert words in str(refused.value)
    assert "trial.sto" in str(refused.value)


@settings(max_examples=60, deadline=None)
@given(at=st.integers(0, 9000))
def test_a_cut_file_gives_one_line_or_the_begin_of_the_trial(tmp_path_factory: pytest.TempPathFactory, at: int) -> None:
    file = sto(tmp_path_factory.getbasetemp() / "cut.sto")
    content = file.read_bytes()
    file.write_bytes(content[:at])
    try:
        trial = read(file)
    except UserError as problem:
        told = str(problem)
    else:
        assert trial.length_m == pytest.approx(LENGTH_M[: trial.time_s.size], abs=1e-10)
        assert trial.warnings or at >= len(content)
        return
    assert "cut.sto" in told
    assert "\n" not in told


def test_what_is_in_it(tmp_path: Path) -> None:
    contents = READERS["sto"].contents(sto(tmp_path / "a.sto"))
    assert [content.name for content in contents.signals] == list(NAMES)
    assert (contents.signals[0].told_role, contents.facts["nrows"]) == ("time", "200")
    assert [content.unit for content in contents.signals] == ["s", "m", "N"]


def test_a_folder_of_them_becomes_bags(tmp_path: Path) -> None:
    sto(tmp_path / "a.sto")
    sto(tmp_path / "b.mot")
    assert reader_for(tmp_path / "b.mot") is READERS["sto"]
    events = list(import_recordings(find_recordings([tmp_path]), ImportSettings(KEYS, "here"), tmp_path / "bags"))
    assert [event.bag.name for event in events if isinstance(event, Imported)] == ["a", "b"]


def test_names_that_tell_volts_are_told(tmp_path: Path) -> None:
    names = ("time", "length_V", "force_V")
    trial = read(
        sto(tmp_path / "a.sto", names=names), columns={"length": {"column": "length_V"}, "force": {"column": "force_V"}}
    )
    assert sum("its name tells V" in line for line in trial.warnings) == 2


NORMALISED = ("time", "soleus_r.normalized_fiber_length", "soleus_r.active_fiber_force_multiplier")


def test_normalised_columns_are_shares_of_l0_and_f0(tmp_path: Path) -> None:
    file = sto(tmp_path / "a.sto", names=NORMALISED, scale=13.0)
    assert [content.unit for content in READERS["sto"].contents(file).signals] == ["s", "L0", "F0"]
    columns = {"length": {"column": NORMALISED[1]}, "force": {"column": NORMALISED[2]}}
    trial = read(file, columns={"length": columns["length"]}, f0=None)
    assert trial.facts.reference_length_m == 1.0
    assert trial.length_change_l0[0] == pytest.approx(0.65 - 1.0)
    with pytest.raises(UserError, match=r"'soleus_r\.active_fiber_force_multiplier' is 300 F0"):
        read(file, columns=columns, f0=None)


@pytest.mark.parametrize("name", ["norm_fiber_length", "soleus/normFiberLength", "fiber_strain"])
def test_a_mapping_that_reads_a_share_of_l0_in_m_is_told(tmp_path: Path, name: str) -> None:
    file = sto(tmp_path / "a.sto", names=("time", name, "force"))
    assert READERS["sto"].contents(file).signals[1].unit == "L0"
    trial = read(file, columns={"length": {"column": name, "unit": "m"}}, f0=None)
    assert f"column '{name}' is read in m, but its name tells a share of L0" in trial.warnings[0]


@pytest.mark.parametrize(
    ("names", "f0", "newtons"),
    [
        (("time", "length_m", "force_mN"), "100 mN", 0.03),
        (("time", "length_m", "force (g)"), "1 N", 0.03 * 9.80665),
        (("time", "length (m)", "force (kPa)"), "100 kPa", 0.3),
        (("time", "length", "force (%F0)"), None, 0.3),
    ],
)
def test_the_unit_in_a_name_is_the_columns(
    tmp_path: Path, names: tuple[str, ...], f0: str | None, newtons: float
) -> None:
    """Regression: mN, kPa and %F0 of a name were read as N without a line."""
    file = sto(tmp_path / "a.sto", names=names, force=0.1)
    columns: dict[str, Any] = {"length": {"column": names[1]}, "force": {"column": names[2]}}
    trial = read(file, columns=columns, f0=f0)
    assert trial.force_n[0] == pytest.approx(newtons)
    assert trial.length_m == pytest.approx(LENGTH_M)
    (line,) = trial.warnings
    assert f"column '{names[2]}' is read in " in line
    assert line.endswith("as its name says, in place of N")


def test_a_name_tells_the_unit_of_length_and_time(tmp_path: Path) -> None:
    file = sto(tmp_path / "a.sto", names=("time_ms", "length_cm", "force"), scale=100.0)
    columns: dict[str, Any] = {"time": {"column": "time_ms"}, "length": {"column": "length_cm"}}
    with pytest.raises(UserError, match="is ms its unit"):
        read(file, columns=columns, f0=None)
    columns["time"]["unit"] = "s"
    trial = read(file, columns=columns, f0=None)
    assert (trial.length_m, trial.time_s) == (pytest.approx(LENGTH_M), pytest.approx(TIME_S, abs=1e-9))
    time, length = sorted(trial.warnings, reverse=True)
    assert "column 'time_ms' is read in s, but its name tells ms; check columns.time.unit (--time-unit)" in time
    assert "column 'length_cm' is read in cm, as its name says, in place of m" in length


@pytest.mark.parametrize(
    ("name", "unit", "line"),
    [
        ("force_mN", "N", "is read in N, but its name tells mN; check columns.force.unit (--force-unit)"),
        ("force (lbf)", None, "is read in N; 'lbf' in its name is no known unit of force; check columns.force.unit"),
        ("force_N", None, ""),
        ("force (lbf)", "N", ""),
        ("force_mN", "mN", ""),
    ],
)
def test_a_unit_of_the_mapping_that_the_name_belies_is_told(
    tmp_path: Path, name: str, unit: str | None, line: str
) -> None:
    file = sto(tmp_path / "a.sto", names=(*NAMES[:2], name))
    force = {"column": name} if unit is None else {"column": name, "unit": unit}
    trial = read(file, columns={"length": {"column": NAMES[1]}, "force": force})
    assert trial.force_n == pytest.approx(FORCE_N * (1e-3 if unit == "mN" else 1.0), abs=1e-8)
    assert [line in each for each in trial.warnings if "its name" in each] == ([True] if line else [])
