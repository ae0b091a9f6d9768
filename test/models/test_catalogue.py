"""Every mechanism's starts, sizes and null."""

from __future__ import annotations

import pytest

from xb_muscle_ros.fit.coordinates import mechanism_coordinates
from xb_muscle_ros.models.catalogue import CATALOGUE
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.parameters import PARAMETERS


@pytest.mark.parametrize("name", CATALOGUE)
def test_starts_lie_within_the_table_and_the_coordinates(name: str) -> None:
    base, entry = load_fibre("18Dec2017a", "2state"), CATALOGUE[name]
    for start in entry.starting_values(base.values):
        for parameter, value in start.items():
            row = PARAMETERS[parameter]
            assert row.lower <= value <= row.upper
        usual = {row.name: row.default or 1.0 for row in PARAMETERS.values()}
        for c in mechanism_coordinates(entry, {**usual, **start}):
            assert c.lower <= c.start <= c.upper
            if c.name == entry.effect:
                assert c.lower <= 0.0 < c.upper
                assert not c.log
                assert (c.prior_mean, c.prior_sd) == (0.0, entry.size)
