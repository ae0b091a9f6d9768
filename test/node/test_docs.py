"""The documentation and the example file name what there is."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml


@pytest.mark.usefixtures("domain")
def test_every_parameter_is_in_the_docs_and_in_the_example(repo_root: Path) -> None:
    """With its default."""
    from xb_muscle_ros.node.parameters import NODE_PARAMETERS, check_node_parameter

    text = (repo_root / "docs" / "node.md").read_text(encoding="utf-8")
    tree = yaml.safe_load((repo_root / "config" / "muscle_node.yaml").read_text(encoding="utf-8"))
    example = tree["/**"]["ros__parameters"]
    assert set(example) == set(NODE_PARAMETERS)
    for name, row in NODE_PARAMETERS.items():
        assert check_node_parameter(name, example[name]) == row.default
        line = next(line for line in text.splitlines() if line.startswith(f"| `{name}` |"))
        assert row.when in line
        assert (str(row.default).lower() if isinstance(row.default, bool) else str(row.default) or "empty") in line


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
