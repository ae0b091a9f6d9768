"""The generator and the tool share no model code."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import xb_muscle_ros.prove.generator as generator

FORBIDDEN = (
    "mechanisms", "models", "distribution", "stepping", "fit", "replay", "measurement", "evaluate", "scores", "plant",
    "node", "bench",
)  # fmt: skip
ALLOWED = ("errors", "fast_yaml", "files", "progress", "trials", "diagnose.names", "prove.generator")
FOLDER = Path(generator.__file__).parent


def _imported(tree: ast.AST) -> set[str]:
    """Modules that a file imports, wherever in it."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            found |= {node.module or ""} | {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def test_generator_names_only_what_it_may() -> None:
    files = sorted(FOLDER.glob("*.py"))
    assert len(files) > 10
    for file in files:
        for module in _imported(ast.parse(file.read_text(encoding="utf-8"))):
            if module.startswith("xb_muscle_ros."):
                inner = module.removeprefix("xb_muscle_ros.")
                assert any(f"{inner}.".startswith(f"{name}.") for name in ALLOWED) or inner == "diagnose", (
                    file,
                    module,
                )


def test_generator_loads_no_model_of_the_tool() -> None:
    modules = [f"xb_muscle_ros.prove.generator.{file.stem}" for file in FOLDER.glob("*.py") if file.stem != "__init__"]
    program = f"import importlib, sys\nfor m in {modules!r}: importlib.import_module(m)\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    loaded = done.stdout.split()
    assert "xb_muscle_ros.prove.generator.kernel" in loaded
    shared = [m for m in loaded for name in FORBIDDEN if f"{m}.".startswith(f"xb_muscle_ros.{name}.")]
    assert shared == []
    tool = [m for m in loaded if m.startswith("xb_muscle_ros.diagnose.") and m != "xb_muscle_ros.diagnose.names"]
    assert tool == []
