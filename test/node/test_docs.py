"""The documentation and the example file name what there is."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml


def _in_words(default: object) -> str:
    if isinstance(default, bool):
        return str(default).lower()
    return "empty" if default in ("", ("",)) else str(default)


@pytest.mark.usefixtures("domain")
def test_every_parameter_is_in_the_docs_and_in_the_example(repo_root: Path) -> None:
    """With its default."""
    from xb_muscle_ros.node.parameters import NODE_PARAMETERS, check_value

    text = (repo_root / "docs" / "node.md").read_text(encoding="utf-8")
    tree = yaml.safe_load((repo_root / "config" / "muscle_node.yaml").read_text(encoding="utf-8"))
    example = tree["/**"]["ros__parameters"]
    assert set(example) == set(NODE_PARAMETERS)
    for name, row in NODE_PARAMETERS.items():
        assert check_value(name, row, example[name]) == row.default
        line = next(line for line in text.splitlines() if line.startswith(f"| `{name}` |"))
        assert row.when in line
        assert _in_words(row.default) in line


def test_every_reason_is_in_the_docs(repo_root: Path) -> None:
    """A reader of diagnostics finds what a reason means."""
    import re

    folder = repo_root / "xb_muscle_ros" / "node"
    source = "".join(path.read_text(encoding="utf-8") for path in folder.glob("*.py"))
    reasons = set(re.findall(r'Refusal\(\s*"([^"]+)"', source))
    assert len(reasons) >= 7
    text = (repo_root / "docs" / "node.md").read_text(encoding="utf-8")
    for reason in reasons:
        assert f"| `{reason}` |" in text


def test_the_example_of_a_simulator_s_loop_runs(repo_root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Two muscles hold 2 kg: the mass bounces within millimetres, and neither falls nor flies."""
    import re

    pytest.importorskip("mujoco", reason="needs the extra mujoco")
    text = (repo_root / "docs" / "node.md").read_text(encoding="utf-8")
    code = next(block for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "mujoco" in block)
    assert len([line for line in code.splitlines() if line.strip()]) <= 30
    names: dict[str, object] = {}
    exec(compile(code, "docs/node.md", "exec"), names)
    height_m = names["height_m"]
    assert isinstance(height_m, list)
    assert len(height_m) == 500
    assert all(-0.001 < height < 0.02 for height in height_m)
    assert max(height_m) > 0.003
    assert capsys.readouterr().out.startswith("from 0 to ")
