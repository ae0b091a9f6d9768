"""The table of faults."""

from __future__ import annotations

from xb_muscle_ros.measurement.faults import FAULTS, ORDINARY


def test_ordinary_faults_are_rows_in_the_order_of_the_table() -> None:
    assert tuple(name for name in FAULTS if name in ORDINARY) == ORDINARY
    assert set(FAULTS) - set(ORDINARY) == {"force_drift", "transducer_lag"}
