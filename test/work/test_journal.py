"""The journal: resumes exactly, survives any cut, and leaves files of others alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import work_tasks
from hypothesis import given, settings
from hypothesis import strategies as st

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.work import Options, identity, run
from xb_muscle_ros.work.identity import Keys
from xb_muscle_ros.work.journal import Journal

DATA = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=10,
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "results" / "journal"


def counted(folder: Path, path: Path, numbers: range) -> list[Any]:
    folder.mkdir(exist_ok=True)
    return run(work_tasks.count, [{"folder": str(folder), "i": i} for i in numbers], Options(processes=0, journal=path))


def test_a_second_run_computes_only_what_is_missing(path: Path, tmp_path: Path) -> None:
    marks = tmp_path / "marks"
    first = counted(marks, path, range(3))
    assert counted(marks, path, range(5))[:3] == first == [0.0, 1 / 7, 2 / 7]
    assert [work_tasks.marks(marks, i) for i in range(5)] == [1] * 5


def test_without_a_journal_all_is_computed_again(tmp_path: Path) -> None:
    for _ in range(2):
        run(work_tasks.count, [{"folder": str(tmp_path), "i": 0}], Options(processes=0))
    assert work_tasks.marks(tmp_path, 0) == 2


def test_results_of_other_code_do_not_match(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    marks = tmp_path / "marks"
    counted(marks, path, range(1))
    with monkeypatch.context() as patch:
        patch.setattr(identity, "environment", lambda: {"xb_muscle_ros": "another"})
        counted(marks, path, range(1))
    assert work_tasks.marks(marks, 0) == 2
    counted(marks, path, range(1))
    assert work_tasks.marks(marks, 0) == 2


def test_keys_tell_functions_and_tasks_apart() -> None:
    tasks: list[Any] = [None, 0, 0.0, False, "0", [0], {"a": 0}, {"a": 1}, 1e-300, -0.0]
    functions = [work_tasks.count, work_tasks.process]
    assert len({Keys(function).of(task) for function in functions for task in tasks}) == 2 * len(tasks)
    keys = Keys(work_tasks.count)
    assert keys.of({"a": 1, "b": 2}) == keys.of({"b": 2, "a": 1})


def test_keys_see_the_code_of_a_function_outside_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    keys = set()
    for body in ("return 1", "return 2"):
        (tmp_path / "changing.py").write_text(f"def function(task):\n    {body}\n")
        sys.modules.pop("changing", None)
        import changing

        keys.add(Keys(changing.function).of(None))
    sys.modules.pop("changing")
    assert len(keys) == 2


def test_an_environment_names_what_results_depend_on() -> None:
    ours = identity.environment()
    assert set(ours) == {"xb_muscle_ros", "Python", "numpy", "scipy", "numba", "sympy"}
    assert identity.differences(ours) == ""
    assert identity.differences({**ours, "numpy": "0.1"}) == f"numpy {ours['numpy']} instead of 0.1"


@settings(max_examples=50)
@given(values=st.dictionaries(st.text("0123456789abcdef", min_size=1, max_size=8), DATA, max_size=6))
def test_values_come_back_exactly(values: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("j") / "journal"
    with Journal(path) as journal:
        for key, value in values.items():
            journal.add(key, json.dumps(value))
    with Journal(path) as journal:
        assert {key: repr(journal[key]) for key in values} == {key: repr(value) for key, value in values.items()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A journal of ten results, as bytes."""
    path = tmp_path_factory.mktemp("whole") / "journal"
    run(work_tasks.awkward_floats, range(10), Options(processes=0, journal=path))
    return path.read_bytes()


@given(data=st.data())
def test_cut_anywhere(whole: bytes, data: st.DataObject, tmp_path_factory: pytest.TempPathFactory) -> None:
    cut = data.draw(st.integers(0, len(whole)))
    path = tmp_path_factory.mktemp("cut") / "journal"
    path.write_bytes(whole[:cut])
    lines = whole.splitlines(keepends=True)
    survivors = sum(len(b"".join(lines[: k + 1])) <= cut for k in range(1, len(lines)))
    with Journal(path) as journal:
        assert sum(json.loads(line)["key"] in journal for line in lines[1:]) == survivors
    # It goes on where it was cut, to the same results and the same file.
    results = run(work_tasks.awkward_floats, range(10), Options(processes=0, journal=path))
    expected = [work_tasks.awkward_floats(i) | {"pair": [i, None]} for i in range(10)]
    assert list(map(repr, results)) == list(map(repr, expected))
    assert path.read_bytes() == whole


def test_a_damaged_line_is_computed_again(whole: bytes, path: Path) -> None:
    path.parent.mkdir()
    lines = whole.splitlines(keepends=True)
    lines[4] = b"\0" * (len(lines[4]) - 1) + b"\n"
    path.write_bytes(b"".join(lines))
    results = run(work_tasks.awkward_floats, range(10), Options(processes=0, journal=path))
    assert results[3]["x"] == work_tasks.awkward_floats(3)["x"]
    assert path.read_bytes() == b"".join([*lines, whole.splitlines(keepends=True)[4]])


@pytest.mark.parametrize("content", [b"time_s,force_n\n0,1\n", b'{"format": 1}', b"\x89PNG\r\n\x1a\n", b"\n", b"x"])
def test_a_file_that_is_no_journal_is_left_alone(content: bytes, path: Path) -> None:
    path.parent.mkdir()
    path.write_bytes(content)
    with pytest.raises(UserError, match=r"journal is not a journal; it was left as it is"):
        run(work_tasks.complain_at_three, [0], Options(processes=0, journal=path))
    assert path.read_bytes() == content


def test_a_journal_of_another_version_is_left_alone(path: Path) -> None:
    path.parent.mkdir()
    path.write_text('{"format":"xb_muscle_ros journal","version":2}\n')
    with pytest.raises(UserError, match="of another version of xb_muscle_ros"):
        Journal(path)
    assert path.read_text().count("\n") == 1


def test_a_journal_that_cannot_be_opened(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot be opened: Is a directory"):
        Journal(tmp_path)


def test_one_run_at_a_time(path: Path) -> None:
    with Journal(path), pytest.raises(UserError, match="in use by another run"):
        Journal(path)
    Journal(path).close()


def test_a_full_disk_is_one_line_and_loses_nothing(tmp_path: Path) -> None:
    # The limit on the size of files stands for the disk; it is a process's own, hence the process.
    script = (
        "import resource, signal, sys, work_tasks; from pathlib import Path\n"
        "from xb_muscle_ros.errors import UserError\n"
        "from xb_muscle_ros.work import Options, run\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (700, 700))\n"
        "try: run(work_tasks.awkward_floats, range(10), Options(processes=0, journal=Path(sys.argv[1])))\n"
        "except UserError as error: print(error)\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path / "journal")], env=environment, capture_output=True, text=True
    )
    assert done.stdout.startswith(f"journal {tmp_path / 'journal'} cannot be written: "), done.stderr
    with Journal(tmp_path / "journal") as journal:
        keys = Keys(work_tasks.awkward_floats)
        assert [keys.of(i) in journal for i in range(10)] == [True] * 3 + [False] * 7
