"""Numbers of a protocol that are out of range: which, what is allowed, what was meant."""

from __future__ import annotations

from pathlib import Path

import pytest

from xb_muscle_ros.cli.main import main
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.protocol import StretchShortenStretch

REFUSED = [
    (["--amplitude", "3.83"], "--amplitude is 3.83 L0; allowed is 0 to 0.5 L0: amplitudes are in L0, 0.0383 is 3.83 %"),
    (["--amplitude", "0.01", "-0.01"], "--amplitude is -0.01 L0; allowed is 0 to 0.5 L0"),
    (["--amplitude", "nan"], "--amplitude is nan L0; allowed is 0 to 0.5 L0"),
    (["--recovery", "-1"], "--recovery is -1 s; allowed is 0 to 3600 s"),
    (["--recovery", "inf"], "--recovery is inf s; allowed is 0 to 3600 s: times are in s"),
    (["--pca", "0.8"], "--pca is 0.8; allowed is 3 to 12"),
    (["--pca", "nan"], "--pca is nan; allowed is 3 to 12"),
    (["--rate", "0"], "--rate is 0 1/s; allowed is 1 to 1e+06 1/s"),
    (["--settle", "0"], "--settle is 0 s; allowed is above 0 to 1e+06 s"),
    (["--settle", "-2"], "--settle is -2 s; allowed is above 0 to 1e+06 s"),
    (["--recovery", "3000", "--rate", "1e5"], "samples; allowed are 20000000: take a lower rate"),
]


@pytest.mark.parametrize(("options", "told"), REFUSED, ids=lambda x: " ".join(x) if isinstance(x, list) else "")
def test_simulate_refuses_in_one_line(
    options: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", "--fiber", "18Dec2017a", "--out", str(tmp_path / "bags"), *options]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert told in lines[0]
    assert not (tmp_path / "bags").exists()


@pytest.mark.parametrize(
    ("field", "value"), [("speed_l0_per_s", 0.0), ("hold_s", -1.0), ("test_stretch_l0", 3.83), ("lead_s", float("nan"))]
)
def test_the_protocol_itself_names_its_field(field: str, value: float) -> None:
    with pytest.raises(UserError, match=f"^protocol: {field} is "):
        StretchShortenStretch(0.01, 0.1, **{field: value})


def test_conditions_that_differ_have_names_that_differ() -> None:
    """Regression: pCa 6.1 and 6.14 went by one name, and the second bag took the first one's place."""
    names = {
        StretchShortenStretch(amplitude, 0.1).trial("f", pca, 100.0).facts.trial
        for pca in (6.1, 6.14)
        for amplitude in (0.0, 2e-5, 4e-5, 0.0383)
    }
    assert len(names) == 8
    assert "amp383_rt100ms_pca61" in names
