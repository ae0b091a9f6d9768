"""The facts that setup.py, package.xml, the locks and the tree each hold must agree."""

from __future__ import annotations

import ast
import re
import runpy
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import pytest
import setuptools
import yaml

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "xb_muscle_ros"

# Where the name to import is not the name to install.
# Numba brings its own llvmlite, of the one version that it goes with.
PROVIDED_BY = {"yaml": "pyyaml", "llvmlite": "numba"}


def normal(requirement: str) -> str:
    """Return the bare name of a requirement as package indexes compare it."""
    name = re.match(r"[A-Za-z0-9._-]+", requirement.strip())
    assert name, requirement
    return re.sub(r"[-_.]+", "-", name[0]).lower()


@pytest.fixture
def arguments(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """What setup.py hands to setuptools."""
    caught: dict[str, Any] = {}
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(setuptools, "setup", caught.update)
    runpy.run_path(str(ROOT / "setup.py"))
    return caught


@pytest.fixture
def manifest() -> ElementTree.Element:
    """The root element of package.xml."""
    return ElementTree.parse(ROOT / "package.xml").getroot()


def pins(*names: str) -> set[str]:
    """Return the names pinned in some of the locks."""
    lines = [line for name in names for line in (ROOT / "requirements" / f"{name}.lock").read_text().splitlines()]
    return {normal(line) for line in lines if line and not line.startswith("#")}


def third_party_imports() -> set[str]:
    """Return the top-level names the package imports that are neither its own nor Python's."""
    names: set[str] = set()
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names.update(alias.name.split(".")[0] for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names.add(node.module.split(".")[0])
    return names - set(sys.stdlib_module_names) - {PACKAGE.name}


def test_setup_and_manifest_agree(arguments: dict[str, Any], manifest: ElementTree.Element) -> None:
    for key in ("name", "version", "description", "license", "maintainer"):
        assert manifest.findtext(key) == arguments[key]
    maintainer = manifest.find("maintainer")
    assert maintainer is not None
    assert maintainer.get("email") == arguments["maintainer_email"]
    assert manifest.get("format") == "3"
    assert manifest.findtext("export/build_type") == "ament_python"


def test_version_is_the_one_the_package_tells(arguments: dict[str, Any]) -> None:
    assert f'__version__ = "{arguments["version"]}"' in (PACKAGE / "__init__.py").read_text()
    assert re.search(rf"^## \[{re.escape(arguments['version'])}\]", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert yaml.safe_load((ROOT / "CITATION.cff").read_text())["version"] == arguments["version"]


def test_every_folder_with_code_is_packaged(arguments: dict[str, Any]) -> None:
    folders = {path.parent for path in PACKAGE.rglob("*.py")}
    assert set(arguments["packages"]) == {".".join(folder.relative_to(ROOT).parts) for folder in folders}


def test_every_typed_and_data_file_is_installed(arguments: dict[str, Any]) -> None:
    assert "py.typed" in arguments["package_data"][PACKAGE.name]
    installed = {name for _, names in arguments["data_files"] for name in names}
    data = [*ROOT.glob("config/**/*.*"), *ROOT.glob("launch/*"), *ROOT.glob("scripts/ros/*")]
    expected = {str(path.relative_to(ROOT)) for path in data if path.is_file()}
    assert expected | {"package.xml", "resource/xb_muscle_ros"} == installed


def test_every_file_that_code_reads_beside_itself_is_packaged(arguments: dict[str, Any]) -> None:
    patterns = arguments["package_data"]
    packaged = {
        path
        for package, globs in patterns.items()
        for pattern in globs
        for path in (ROOT / package.replace(".", "/")).glob(pattern)
    }
    found = {p for p in PACKAGE.rglob("*") if p.is_file() and p.suffix not in (".py", ".pyc", ".so", ".nbi", ".nbc")}
    assert found == packaged
    assert {p.name for p in found} >= {"report.css", "page.html.j2"}


def test_programs_can_be_run_by_ros2_run() -> None:
    programs = list((ROOT / "scripts" / "ros").iterdir())
    assert {path.name for path in programs} == {"muscle_node", "plant_node", "xb_muscle"}
    for path in programs:
        assert path.stat().st_mode & 0o111
        assert path.read_text().startswith("#!/usr/bin/env python3\n")


def test_locks_pin_what_setup_names(arguments: dict[str, Any]) -> None:
    assert {normal(name) for name in arguments["install_requires"]} <= pins("base")
    assert {normal(name) for name in arguments["extras_require"]["test"]} <= pins("base", "test")
    wanted = (ROOT / "requirements" / "ros.in").read_text().splitlines()
    assert {normal(line) for line in wanted if line and not line.startswith("#")} <= pins("base", "ros")


def test_locks_hold_exact_pins_once_per_python() -> None:
    for path in (ROOT / "requirements").glob("*.lock"):
        lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
        assert lines
        for line in lines:
            assert re.fullmatch(r"[a-z0-9-]+==[0-9][0-9a-z.]*( ; python_full_version [<>=]+ '3\.\d+')?", line), line
        assert len(lines) == len({(normal(line), line.partition(";")[2]) for line in lines})


def test_every_import_is_declared(arguments: dict[str, Any], manifest: ElementTree.Element) -> None:
    extras = [name for names in arguments["extras_require"].values() for name in names]
    declared = {normal(name) for name in [*arguments["install_requires"], *extras]}
    ros = {normal(element.text or "") for element in manifest.findall("exec_depend")}
    # OpenSim has an environment of its own, see scripts/setup_peers.
    pins = (ROOT / "requirements" / "peers.lock").read_text(encoding="utf-8").splitlines()
    apart = {normal(pin.partition("==")[0]) for pin in pins if "==" in pin}
    for name in sorted(third_party_imports()):
        assert normal(PROVIDED_BY.get(name, name)) in declared | ros | apart, f"{name} is imported but declared nowhere"


def test_ros_finds_what_pip_installs(arguments: dict[str, Any], manifest: ElementTree.Element) -> None:
    # rosdep's keys that are called otherwise, or whose package brings what is asked for.
    keys_of = {
        "rosbags": "python3-rosbags-pip",
        "lz4": "python3-rosbags-pip",
        "zstandard": "python3-rosbags-pip",
        "mcap": "mcap-ros2-support",
        "mujoco": "python3-mujoco-pip",
    }
    keys = {element.text for element in manifest.findall("exec_depend")}
    asked = [*arguments["install_requires"], *arguments["extras_require"]["mujoco"]]
    for name in {normal(name) for name in asked}:
        assert keys_of.get(name, f"python3-{name.removeprefix('py')}") in keys, name


def test_tests_import_nothing_that_ros_does_not_find(manifest: ElementTree.Element) -> None:
    """`colcon test` runs after `rosdep install`: what a test imports at its top has a key, or the test is skipped."""
    keys = {element.text for kind in ("exec_depend", "test_depend") for element in manifest.findall(kind)}
    provided = {"rosbags": "python3-rosbags-pip", "mcap": "mcap-ros2-support", "yaml": "python3-yaml"}
    own = {path.stem for path in (ROOT / "test").rglob("*.py")}
    for path in (ROOT / "test").rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for node in tree.body:
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and not node.level:
                names = [node.module or ""]
            else:
                continue
            for name in {name.split(".")[0] for name in names} - set(sys.stdlib_module_names) - own - {PACKAGE.name}:
                assert {name, f"python3-{name}", provided.get(name)} & keys, f"{path.name} imports {name}"
