"""What the page tells beside the verdict, and that it is written whole, the same each time, or not at all."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.diagnose.report import write_report
from xb_muscle_ros.errors import UserError


def test_conflicts_and_the_source_of_noise_are_told(made: Any) -> None:
    text = made("physics").report().read_text(encoding="utf-8")
    assert "The solutions contradict each other" in text
    assert re.search(r'solution \(pCa\)</td><td class="r">2</td><td class="r"><a [^>]*>97 %</a>', text)
    assert re.search(r">0\.10</a>\*</td>", text)
    assert "* Noise: what smooth curves leave of force" in text


def test_a_summary_of_the_users_own_stays_as_it_is(made: Any) -> None:
    given = made("none")
    given.facts["summary"] = "My words & my F0 <b>only</b>."
    text = given.report().read_text(encoding="utf-8")
    assert '<p class="lead">My words &amp; my F<sub>0</sub> &lt;b&gt;only&lt;/b&gt;.</p>' in text


@pytest.mark.parametrize(("count", "pages"), [(1, 1), (10, 2)])
def test_trials_are_split_over_figures(made: Any, count: int, pages: int) -> None:
    pcas = tuple(float(p) for p in np.linspace(6.6, 4.5, count).round(2))
    given = made("physics", pcas)
    text = given.report().read_text(encoding="utf-8")
    assert len(re.findall('alt="Measured and modelled force of every trial', text)) == pages


def test_the_same_diagnosis_makes_the_same_page(made: Any) -> None:
    given = made("none", (4.5,))
    assert given.report().read_bytes() == given.report().read_bytes()


@pytest.mark.parametrize(
    ("damage", "names"),
    [
        (lambda folder: (folder / "traces.npz").unlink(), "traces.npz"),
        (lambda folder: (folder / "traces.npz").write_bytes(b"PK no zip"), "traces.npz"),
        (lambda folder: (folder / "diagnosis.json").write_text("{"), "diagnosis.json"),
        (lambda folder: (folder / "diagnosis.json").write_text("[]"), "diagnosis.json"),
        (lambda folder: np.savez(folder / "traces.npz", t0_time_s=np.zeros(3)), "t1_time_s"),
        (lambda folder: np.savez(folder / "traces.npz", t0_time_s=[0.0, 1.0], t0_after_f0=[0.0]), "t0_after_f0"),
    ],
)  # fmt: skip
def test_damage_is_named_and_nothing_is_written(made: Any, damage: Any, names: str) -> None:
    folder = made("none").folder
    damage(folder)
    before = sorted(folder.iterdir())
    with pytest.raises(UserError, match=names):
        write_report(folder)
    assert sorted(folder.iterdir()) == before


def test_the_page_appears_whole_or_not_at_all(made: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = made("none").folder
    (folder / "report.html").write_text("the old one", encoding="utf-8")
    before = sorted(folder.iterdir())

    def full(self: Path, *args: Any, **kwargs: Any) -> int:
        with self.open("w", encoding="utf-8") as file:
            file.write("<!DOCTYPE")
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_text", full)
        with pytest.raises(OSError, match="No space"):
            write_report(folder)
    assert sorted(folder.iterdir()) == before
    assert (folder / "report.html").read_text(encoding="utf-8") == "the old one"
