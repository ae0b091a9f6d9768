"""Units and quantities."""

from __future__ import annotations

import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.inspecting.words import units_meant
from xb_muscle_ros.trials.readers.units import Quantity, quantity, unit_in, unit_of


@pytest.mark.parametrize(
    ("text", "column", "kind", "factor"),
    [
        ("ms", "time", "time", 1e-3),
        ("mm", "length", "length", 1e-3),
        ("µm", "length", "length", 1e-6),  # micro sign
        ("μm", "length", "length", 1e-6),  # Greek mu
        ("%L0", "length", "relative length", 0.01),
        ("mN", "force", "force", 1e-3),
        ("kPa", "force", "stress", 1e3),
        ("mN/mm²", "force", "stress", 1e3),
        ("mN mm^-2", "force", "stress", 1e3),
        ("N·cm⁻²", "force", "stress", 1e4),
        ("mN/cm2", "force", "stress", 10.0),
        ("g", "force", "force", 9.80665e-3),
        ("F0", "force", "relative force", 1.0),
        ("nM", "calcium", "calcium", 1e-3),
        ("M", "calcium", "calcium", 1e6),
    ],
)
def test_units(text: str, column: str, kind: str, factor: float) -> None:
    assert unit_of(text, column, "here") == (kind, factor, "")


@pytest.mark.parametrize(
    ("text", "column", "name"),
    [
        ("% F0", "force", "%F0"),
        ("% Fo", "force", "%F0"),
        ("Po", "force", "F0"),
        ("P/Po", "force", "F0"),
        ("T/T0", "force", "F0"),
        ("mN mm-2", "force", "mN/mm2"),
        ("mN·mm⁻²", "force", "mN/mm2"),
        ("mN.mm−2", "force", "mN/mm2"),
        ("N cm-2", "force", "N/cm2"),
        ("kN/m^2", "force", "kPa"),
        ("N/m²", "force", "Pa"),
        ("(grams)", "force", "g"),
        ("% Lo", "length", "%L0"),
        ("Lo", "length", "L0"),
        ("g", "length", None),
        ("mN m-3", "force", None),
        ("Nm", "force", None),
    ],
)
def test_units_as_files_write_them(text: str, column: str, name: str | None) -> None:
    assert unit_in(text, column) == name
    meant = units_meant(text.strip("()"))
    assert (name is None) != (name in meant)


def test_an_unknown_unit_is_answered_with_the_nearest() -> None:
    with pytest.raises(UserError, match="here: unit 'kPas' of force is not known; did you mean 'kPa'"):
        unit_of("kPas", "force", "here")


@pytest.mark.parametrize(("text", "factor"), [("%Po", 0.01), ("P/Po", 1.0), ("kpa", 1e3), ("grams", 9.80665e-3)])
def test_other_spellings_are_units_too(text: str, factor: float) -> None:
    assert unit_of(text, "force", "here").factor == factor


def test_a_unit_of_something_else_is_refused() -> None:
    with pytest.raises(UserError, match="here: 'mm' is no unit of time; allowed: s, ms, us"):
        unit_of("mm", "time", "here")


def test_quantities_come_in_base_units() -> None:
    assert quantity("42.8 mm", "length", "reference_length", "here") == Quantity(pytest.approx(0.0428), "length")
    assert quantity("42.8mm", "length", "reference_length", "here") == Quantity(pytest.approx(0.0428), "length")
    assert quantity("1e-3N", "force", "f0", "here") == Quantity(1e-3, "force")
    assert quantity("100%L0", "length", "reference_length", "here") == Quantity(pytest.approx(1.0), "relative length")
    assert quantity(" 97 kPa", "force", "f0", "here") == Quantity(97e3, "stress")
    assert quantity("20 N cm-2", "force", "f0", "here") == Quantity(2e5, "stress")
    assert quantity("80 % Po", "force", "f0", "here") == Quantity(0.8, "relative force")


@pytest.mark.parametrize("text", ["42.8", "mm", "4 2.8 mm", "-1 mm", "0 mm", "nan mm", "inf mm", "long mm", ""])
def test_what_is_no_quantity_is_refused(text: str) -> None:
    with pytest.raises(UserError, match=r"reference_length is '.*'; needed is a number above 0 and its unit"):
        quantity(text, "length", "reference_length", "here")
