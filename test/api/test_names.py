"""``import xb_muscle_ros as xb``: quick, lazy, typed, and documented."""

from __future__ import annotations

import ast
import dataclasses
import doctest
import inspect
import os
import subprocess
import sys
from pathlib import Path

import pytest

import xb_muscle_ros as xb

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "xb_muscle_ros"
FUNCTIONS = [name for name in xb.__all__ if inspect.isfunction(getattr(xb, name))]
CLASSES = [name for name in xb.__all__ if inspect.isclass(getattr(xb, name))]
RECORDS = [name for name in CLASSES if dataclasses.is_dataclass(getattr(xb, name))]


def printed(code: str) -> str:
    """What a fresh Python says."""
    command = [sys.executable, "-c", code]
    return subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout.strip()


def test_import_is_quick_and_loads_nothing_heavy() -> None:
    code = (
        "import sys, time; begun = time.perf_counter(); import xb_muscle_ros as xb; took = time.perf_counter() - begun;"
        "heavy = {'numba', 'numpy', 'scipy', 'matplotlib', 'pandas', 'rclpy', 'sympy'} & set(sys.modules);"
        "print(took, *sorted(heavy))"
    )
    took, *heavy = min((printed(code).split() for _ in range(3)), key=lambda words: float(words[0]))
    assert not heavy
    assert float(took) < 0.05


@pytest.mark.slow
def test_ros_and_matplotlib_wait_until_they_are_used() -> None:
    code = "import sys, xb_muscle_ros as xb; xb.replay, xb.fit; print({'matplotlib', 'rclpy'} & set(sys.modules))"
    assert printed(code) == "set()"


def test_stub_names_what_the_package_gives() -> None:
    stub = ast.parse((PACKAGE / "__init__.pyi").read_text(encoding="utf-8"))
    told = {a.asname: node.module for node in stub.body if isinstance(node, ast.ImportFrom) for a in node.names}
    assert told == {name: f"xb_muscle_ros.{home}" for name, home in xb._HOME_OF.items()}
    assert set(told) | {"__version__"} == set(xb.__all__)


@pytest.mark.slow
def test_functions_stay_where_folders_of_their_names_are_imported() -> None:
    code = (
        "import xb_muscle_ros as xb, xb_muscle_ros.fit.run, xb_muscle_ros.replay.run, xb_muscle_ros.evaluate.run;"
        "from xb_muscle_ros.fit import split; import xb_muscle_ros.diagnose.run;"
        "kinds = [type(getattr(xb, name)).__name__ for name in ('fit', 'replay', 'evaluate', 'diagnose')];"
        "print(*kinds, split.__name__)"
    )
    assert printed(code) == "function function function function xb_muscle_ros.fit.split"


def test_former_ways_in_are_kept() -> None:
    from xb_muscle_ros.models.batch import MuscleBatch
    from xb_muscle_ros.models.fibre_file import load_fibre

    assert (MuscleBatch, load_fibre) == (xb.MuscleBatch, xb.load_fibre)


def test_a_name_that_is_none_lists_those_that_are() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'simulat'; public are .*simulate"):
        _ = xb.simulat
    assert set(xb.__all__) <= set(dir(xb))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_say_units_errors_and_source(name: str) -> None:
    function = getattr(xb, name)
    told = inspect.getdoc(function) or ""
    sections = ("Args:", "Raises:", "Source:", "Examples:")
    missing = [section for section in sections if section not in told]
    signature = inspect.signature(function)
    if signature.return_annotation != "None" and "Returns:" not in told:
        missing.append("Returns:")
    assert not missing
    assert not [p for p in signature.parameters if p not in told]
    assert any(unit in told for unit in ("shape", "L0", "unit", " m", " s"))


@pytest.mark.parametrize("name", CLASSES)
def test_classes_say_what_they_hold(name: str) -> None:
    each = getattr(xb, name)
    told = inspect.getdoc(each) or ""
    assert told
    if name in RECORDS:
        assert "Attributes:" in told
        assert not [field.name for field in dataclasses.fields(each) if field.name not in told]
    for method, function in vars(each).items():
        if not method.startswith("_") and (inspect.isfunction(function) or isinstance(function, property)):
            assert inspect.getdoc(function), f"{name}.{method}"


@pytest.mark.slow
@pytest.mark.parametrize("name", [*FUNCTIONS, *CLASSES])
def test_examples_run(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.IGNORE_EXCEPTION_DETAIL)
    for test in doctest.DocTestFinder(recurse=True).find(getattr(xb, name), name, globs={}):
        assert runner.run(test).failed == 0


def test_python_of_the_readme_runs(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(ROOT)
    blocks = (ROOT / "README.md").read_text(encoding="utf-8").split("```python\n")[1:]
    assert blocks
    for block in blocks:
        exec(compile(block.split("```")[0], "README.md", "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out


def test_a_folder_of_the_same_name_is_not_taken_for_the_package(tmp_path: Path) -> None:
    # Beside a clone, whose folder is called like the package.
    (tmp_path / "xb_muscle_ros").mkdir()
    code = "import xb_muscle_ros as xb; print(xb.load_fibre('18Dec2017a').name)"
    env = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=env, capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("18Dec2017a\n", "")
