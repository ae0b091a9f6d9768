"""Every row of the studies leads to a function."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from xb_muscle_ros.bench import studies


@pytest.mark.parametrize("name", studies.STUDIES)
def test_a_study_is_a_function_of_its_module(name: str) -> None:
    """Read, not imported: some need ROS 2 or CasADi."""
    study = studies.STUDIES[name]
    source = (Path(studies.__file__).parent / f"{study.module}.py").read_text(encoding="utf-8")
    found = {node.name: node for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)}
    assert [argument.arg for argument in found[study.function].args.args] == ["setting"]
    assert study.help
