"""The Python of docs/body.md runs as it is printed, and does what it says."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from xb_muscle_ros.plant.mjcf.table import choices

pytest.importorskip("mujoco")
pytest.importorskip("myo_sim")

PAGE = Path(__file__).resolve().parents[3] / "docs" / "body.md"


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_examples_run_one_after_the_other(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for block in blocks("python"):
        exec(compile(block, str(PAGE), "exec"), names)
    pull = re.search(r"tibialis anterior pulls with (\d+) N", capsys.readouterr().out)
    # More than settled at 5 %, on its way to half of F0.
    f0 = names["muscles"].f0_n[names["muscles"].names.index("tibant_r")]
    assert pull is not None
    assert 0.1 * f0 < float(pull[1]) < 0.6 * f0
    assert names["posture"].shape == (names["model"].nq,)
    assert np.isfinite(names["posture"]).all()
    assert not names["terminated"]


def test_the_first_example_has_twenty_lines_at_most() -> None:
    assert len([line for line in blocks("python")[0].splitlines() if line]) <= 20


def test_the_printed_table_is_one() -> None:
    (printed,) = blocks("yaml")
    soleus, tibialis, rectus = choices(yaml.safe_load(printed), ("soleus_r", "tibant_r", "recfem_r"))
    assert (soleus.tendon, dict(soleus.parameters)) == ("elastic", {"k21": 18.0})
    assert (tibialis.fibre, tibialis.tendon) == ("7Aug2018a", "rigid")
    assert rectus.model == "hill"
