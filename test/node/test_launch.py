"""Launch files give parameters that there are; with ROS' own launch at hand they are loaded as well."""

from __future__ import annotations

import ast
import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

FILES = ("muscle", "muscles", "closed_loop", "replay")
LAUNCHING = "xb_muscle_ros/node/launching.py"


def keys_by_name(text: str) -> Iterator[tuple[str, set[str]]]:
    """Tables of a file's top level whose keys are parameters, by the table's name."""
    for statement in ast.parse(text).body:
        if isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Dict):
            target = statement.targets[0]
            assert isinstance(target, ast.Name)
            yield target.id, {key.value for key in statement.value.keys if isinstance(key, ast.Constant)}


@pytest.mark.usefixtures("domain")
def test_parameters_are_those_of_the_nodes(repo_root: Path) -> None:
    """Whoever renames one is told."""
    from xb_muscle_ros.node.parameters import NODE_PARAMETERS, TEXTS
    from xb_muscle_ros.plant.plant_parameters import PLANT_PARAMETERS

    known = {
        "OF_MUSCLES": {*NODE_PARAMETERS, *TEXTS, "use_sim_time"},
        "PARAMETERS": {*NODE_PARAMETERS, *TEXTS, "use_sim_time"},
        "OF_BOTH": ({*NODE_PARAMETERS} | {*TEXTS}) & {*PLANT_PARAMETERS},
        "OF_THE_BODY": {*PLANT_PARAMETERS},
        "OF_THE_MUSCLES": {*NODE_PARAMETERS},
    }
    met = 0
    for name in [*(f"launch/{name}.launch.py" for name in FILES), LAUNCHING]:
        for table, keys in keys_by_name((repo_root / name).read_text(encoding="utf-8")):
            if table in known:
                assert keys <= known[table], (name, keys - known[table])
                met += 1
    assert met == 6


def test_every_launch_file_takes_what_all_take(repo_root: Path) -> None:
    """And starts its nodes by the one function that makes use of it."""
    for name in ("muscle", "muscles"):
        text = (repo_root / "launch" / f"{name}.launch.py").read_text(encoding="utf-8")
        assert f'return muscle_description("{name}", ' in text, name
    for name in ("launch/closed_loop.launch.py", "launch/replay.launch.py", LAUNCHING):
        text = (repo_root / name).read_text(encoding="utf-8")
        assert "*common_arguments()" in text, name
        assert 'node(context, "muscle_node"' in text, name
        assert '"autostart": bool' in text, name


@pytest.mark.parametrize("name", FILES)
def test_they_load(repo_root: Path, name: str) -> None:
    """Every argument that is used is declared."""
    launch = pytest.importorskip("launch", reason="ROS' launch does not come as a wheel")
    pytest.importorskip("launch_ros", reason="launch_ros does not come as a wheel")
    made: Any = runpy.run_path(str(repo_root / "launch" / f"{name}.launch.py"))["generate_launch_description"]()
    declared = {argument.name for argument in made.get_launch_arguments()}
    assert {"autostart", "params_file", "log_level", "remaps", "respawn"} <= declared
    text = (repo_root / "launch" / f"{name}.launch.py").read_text(encoding="utf-8")
    calls = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call)]
    used = {
        call.args[0].value
        for call in calls
        if getattr(call.func, "id", "") == "LaunchConfiguration" and isinstance(call.args[0], ast.Constant)
    }
    assert used <= declared
    assert isinstance(made, launch.LaunchDescription)
