"""A spread of cells of the authors' tables; scripts/golden.py compares all of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.bench.golden import STEPPERS, compare, samples
from xb_muscle_ros.errors import UserError


@pytest.mark.parametrize(
    ("table", "largest"), [("3state_coop", 0.02), ("3state_coop_v3", 0.06), ("2state_xb", 0.02)], ids=lambda x: str(x)
)
def test_cells_agree(shared_data: Path, table: str, largest: float) -> None:
    # Strides that share no factor with the axes: every fibre, and all pCa, recoveries and amplitudes come up.
    cells = list(compare(shared_data / "golden_srs.json", table, every=(1, 2, 3, 2)))
    assert {c.fibre for c in cells} == {"13Dec2017a", "14Dec2017b", "18Dec2017a", "18Dec2017b", "19Dec2017a"}
    for stepper in STEPPERS:
        errors = [c.error for c in cells if c.stepper == stepper]
        assert len(errors) > 300
        assert np.median(errors) < 0.001
    assert [c for c in cells if c.error > largest] == []


def test_the_protocol_is_sampled_across_its_corners() -> None:
    s = samples(0.0383, 0.1)
    assert s.conditioning_s == pytest.approx(2.0, abs=1e-12)
    assert s.test_s == pytest.approx(2.0 + 2 * 0.0383 / 0.4545 + 0.1, abs=1e-12)
    assert s.time_s[0] <= s.conditioning_s < s.time_s[1]
    assert s.length_l0[0] == 0.0
    assert s.length_l0.max() == pytest.approx(0.0383, abs=5e-4)


def test_missing_tables_are_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"nowhere\.json do not exist"):
        list(compare(tmp_path / "nowhere.json", "3state_coop"))
