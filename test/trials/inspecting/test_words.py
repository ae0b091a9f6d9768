"""What names and units of columns are taken for."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from xb_muscle_ros.trials.inspecting.words import fitting, read_name, roles_of_unit, units_meant
from xb_muscle_ros.trials.readers.units import UNITS


@pytest.mark.parametrize(
    ("name", "role", "unit"),
    [
        ("time_s", "time", "s"),
        ("Time (ms)", "time", "ms"),
        ("Zeit [s]", "time", "s"),
        ("temps / ms", "time", "ms"),
        ("t", "time", ""),
        ("Lin (mm)", "length", "mm"),
        ("Länge in mm", "length", "mm"),
        ("fibreLength_um", "length", "um"),
        ("L/L0", "", ""),
        ("length (L/Lo)", "length", "L0"),
        ("Force, mN", "force", "mN"),
        ("Kraft_mN", "force", "mN"),
        ("force_n", "force", "N"),
        ("Stress (mN/mm²)", "force", "mN/mm2"),
        ("tension (P/P0)", "force", "F0"),
        ("calcium_um", "calcium", "uM"),
        ("[Ca2+] (µM)", "calcium", "uM"),
        ("pCa", "calcium", "pCa"),
        ("stim_v", "stimulation", "V"),
        ("长度 (mm)", "length", "mm"),
        ("сила [Н]", "force", ""),
    ],
)
def test_names_in_several_languages(name: str, role: str, unit: str) -> None:
    named = read_name(name)
    assert named.roles == ((role,) if role else ())
    assert (fitting(named.unit, role) if role else "") == unit
    assert not named.why_not


@pytest.mark.parametrize(
    "name", ["velocity (mm/s)", "force_simulated_n", "SD", "ce_length_m", "Temperature (C)", "fiber width (um)"]
)
def test_what_only_sounds_like_a_signal_is_none(name: str) -> None:
    assert read_name(name).why_not


def test_more_that_a_name_tells() -> None:
    assert read_name("Lout (mm)").is_command
    assert not read_name("Lin (mm)").is_command
    assert read_name("length_change_l0").is_change
    assert read_name("ΔL (um)").is_change
    assert read_name("SL (um)").length_of == "sarcomere"
    assert read_name("half sarcomere length (nm)").length_of == "half_sarcomere"
    assert read_name("force time").roles == ("time", "force")


def test_a_unit_alone_tells_a_role_as_it_is_written() -> None:
    assert roles_of_unit("mN") == ("force",)
    assert roles_of_unit("m") == ("length",)
    assert roles_of_unit("M") == ("calcium",)
    assert units_meant("um") == ("um", "uM")
    assert roles_of_unit("g") == ()


@given(st.text(max_size=30))
def test_any_name_is_read(name: str) -> None:
    named = read_name(name)
    assert len(set(named.roles)) == len(named.roles)
    assert all(unit in UNITS for unit in units_meant(named.unit))
