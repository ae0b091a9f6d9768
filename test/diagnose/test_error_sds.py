"""Standard deviations of ordinary measurement errors that a study has of its own."""

from __future__ import annotations

import pytest

from xb_muscle_ros.diagnose.error_sds import error_sd_lines, error_sds_of
from xb_muscle_ros.errors import UserError


def test_what_is_given_is_taken_and_told() -> None:
    found = error_sds_of(["time_shift=0.002", "pca_shift=0.1"])
    assert found == {"time_shift": 0.002, "pca_shift": 0.1}
    assert error_sd_lines(found) == [
        "ordinary measurement error 'time_shift' has SD 0.002 s, as was asked (usually 0.0007 s)",
        "ordinary measurement error 'pca_shift' has SD 0.1, as was asked (usually 0.05)",
    ]
    assert error_sd_lines({}) == []


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["time_shift=0.002", "time_shift=0.001"], "--nuisance time_shift is given an SD twice"),
        (["time_shift=2ms"], r"SD '2ms' is no number; give FAULT=SD without a unit, such as time_shift=0.002 \(s\)"),
        (["time_shift"], "SD '' is no number"),
    ],
)
def test_arguments_that_cannot_be_read(given: list[str], words: str) -> None:
    with pytest.raises(UserError, match=words):
        error_sds_of(given)


@pytest.mark.parametrize(
    ("name", "sd", "words"),
    [
        ("time_shift", 1e-300, "SD 1e-300 s; allowed is 7e-07 to 0.01 s; usual is 0.0007 s"),
        ("time_shift", float("nan"), "SD nan s; allowed"),
        ("time_shift", float("inf"), "SD inf s; allowed"),
        ("pca_shift", -1.0, "SD -1; allowed is 5e-05 to 0.5"),
        ("run_down", 0.0, "SD 0; allowed"),
        ("transducer_lag", 1e-3, "'transducer_lag' is a candidate of every diagnosis and no ordinary error"),
        ("time_shft", 1e-3, "'time_shft' is not known; did you mean 'time_shift'?"),
    ],
)
def test_sds_that_are_refused(name: str, sd: float, words: str) -> None:
    with pytest.raises(UserError) as caught:
        error_sd_lines({name: sd})
    assert words in str(caught.value)
    assert str(caught.value).startswith("--nuisance")
