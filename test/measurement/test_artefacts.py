"""The table of faults."""

from __future__ import annotations

from xb_muscle_ros.measurement.artefacts import ARTEFACTS, ORDINARY


def test_ordinary_faults_are_rows_in_the_order_of_the_table() -> None:
    assert tuple(name for name in ARTEFACTS if name in ORDINARY) == ORDINARY
    assert set(ARTEFACTS) - set(ORDINARY) == {"force_drift", "transducer_lag"}
