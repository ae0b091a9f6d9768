"""Blocks are found without being listed anywhere: those of the package, then those of files and installed packages."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from xb_muscle_ros import plugins
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.mechanisms import Family, discovery

MINE = """
from xb_muscle_ros.mechanisms import Entry, Extra, Parameter

DRAG = Parameter("my_drag", "F0 s/L0", "drag", 0.0, 10.0, 0.0, "this lab")


class MyDrag(Extra):
    name = "my_drag_of_mine"
    parameters = (DRAG,)
    entry = Entry("mine", "my drag", "a drag of my own", "my_drag", 0.02, starts=({"my_drag": 0.01},))

    def force(self, q):
        return q.my_drag * q.velocity
"""


def run(code: str, mechanisms: str, **more: str) -> subprocess.CompletedProcess[str]:
    """Code in a process of its own, with mechanisms from outside."""
    environment = {**os.environ, plugins.VARIABLE: mechanisms, **more}
    return subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)


def test_the_package_s_blocks_come_family_by_family() -> None:
    blocks = discovery.found()
    families = [block.family for block in blocks]
    assert families == sorted(families, key=list(Family).index)
    assert set(families) == set(Family)
    assert not any(discovery.is_outside(block) for block in blocks)
    assert discovery.found() == blocks


def test_a_file_of_one_s_own_is_a_mechanism_everywhere(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("from _help import *\n" + MINE, encoding="utf-8")
    (tmp_path / "_help.py").write_text("", encoding="utf-8")
    code = """
from xb_muscle_ros.diagnose.answers import FAMILY, MECHANISMS
from xb_muscle_ros.diagnose.search.whole import beside, whole
from xb_muscle_ros.diagnose.words import family_words, human, meaning
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.parameters import PARAMETERS
name = MECHANISMS[-1]
print(name, FAMILY[name], human(name), meaning(name), family_words("mine"), PARAMETERS["my_drag"].unit, sep="|")
fibre, bare = load_fibre("18Dec2017a", "3state_coop+" + name), load_fibre("18Dec2017a")
print(fibre.values["my_drag"], name in beside(bare), whole(bare, ()).model[-37:])
"""
    for named in (str(tmp_path), str(tmp_path / "mine.py")):
        done = run(code, named)
        assert done.stderr == ""
        assert done.stdout.splitlines() == [
            "my_drag_of_mine|mine|my drag|a drag of my own|mine|F0 s/L0",
            "0.0 True temperature+phosphate+my_drag_of_mine",
        ]


def test_installed_packages_bring_mechanisms_by_entry_points(tmp_path: Path) -> None:
    (tmp_path / "lab").mkdir()
    (tmp_path / "lab" / "__init__.py").write_text(MINE, encoding="utf-8")
    about = tmp_path / "lab-1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: lab\nVersion: 1\n", encoding="utf-8")
    (about / "entry_points.txt").write_text(f"[{plugins.GROUP}]\nlab = lab\n", encoding="utf-8")
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    done = run("from xb_muscle_ros.models.registry import EXTRAS; print([*EXTRAS][-1])", "", PYTHONPATH=path)
    assert (done.stderr, done.stdout) == ("", "my_drag_of_mine\n")


@pytest.mark.parametrize(
    ("files", "told"),
    [
        ({}, "names .*, which is no Python file and no folder with some"),
        ({"a.py": "x = (\n"}, r"a\.py, line 1: SyntaxError"),
        ({"a.py": "\n\nimport nothing_of_this_name\n"}, r"a\.py, line 3: ModuleNotFoundError: .*; mend it"),
        ({"a.py": "x = 1\n"}, r"a\.py has no mechanism"),
        ({"a.py": "import helper_of_mine\n" + MINE, "_b.py": ""}, "ModuleNotFoundError"),
    ],
)
def test_what_cannot_be_imported_is_told_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, files: dict[str, str], told: str
) -> None:
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.setenv(plugins.VARIABLE, str(tmp_path))
    with pytest.raises(UserError, match=told) as error:
        discovery.found()
    assert "\n" not in str(error.value)
    sys.modules.pop("xb_muscle_mechanisms_a", None)


def test_a_helper_that_would_stay_behind_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mine.py").write_text("import beside_mine\n" + MINE, encoding="utf-8")
    (tmp_path / "beside_mine.py").write_text("", encoding="utf-8")
    monkeypatch.setenv(plugins.VARIABLE, str(tmp_path / "mine.py"))
    with pytest.raises(UserError, match=r"imports beside_mine\.py beside it; call that _beside_mine\.py"):
        discovery.found()
    for name in ("beside_mine", "xb_muscle_mechanisms_mine"):
        sys.modules.pop(name, None)


def test_a_refusal_ends_a_command_in_one_line_with_code_2(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(MINE.replace("q.velocity", "q.velocty"), encoding="utf-8")
    code = "import sys; from xb_muscle_ros.cli.main import main; sys.exit(main(['parameters']))"
    done = run(code, str(tmp_path))
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("xb_muscle: error: mechanism 'my_drag_of_mine' (")
    assert "'velocty', which no block of this model provides; did you mean 'velocity'?" in line


def test_other_machines_get_the_same_mechanisms(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert plugins.identity() == plugins.NONE
    for name in ("mine.py", "_help.py", "other.py"):
        (tmp_path / name).write_text(f"# {name}\n", encoding="utf-8")
    monkeypatch.setenv(plugins.VARIABLE, str(tmp_path / "mine.py"))
    given, here = plugins.texts(), plugins.identity()
    assert sorted(given) == ["0/_help.py", "0/mine.py"]
    monkeypatch.delenv(plugins.VARIABLE)
    monkeypatch.setattr(plugins.tempfile, "mkdtemp", lambda prefix: (tmp_path / "there").mkdir() or tmp_path / "there")
    plugins.use(given)
    assert plugins.identity() == here
    assert [file.name for file in plugins.files()] == ["mine.py"]
    (tmp_path / "there" / "0" / "_help.py").write_text("# changed\n", encoding="utf-8")
    assert plugins.identity() != here
