"""Fibre files that are written come back as they were."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import changed, load_fibre
from xb_muscle_ros.models.fibre_writing import fibre_text, write_fibre


@settings(max_examples=30, deadline=None)
@given(
    name=st.text(st.characters(blacklist_categories=("Cs", "Cc")), min_size=1, max_size=20),
    source=st.text(st.characters(blacklist_categories=("Cs",)), min_size=1, max_size=200),
    koff=st.floats(0.1, 1e4),
)
def test_what_is_written_is_read_back_bit_for_bit(
    tmp_path_factory: pytest.TempPathFactory, name: str, source: str, koff: float
) -> None:
    path = tmp_path_factory.mktemp("fibre") / "f.yaml"
    fibre = changed(load_fibre("18Dec2017a"), {"koff": koff}, "test")
    fibre = replace(fibre, name=name, source=source)
    write_fibre(path, fibre, ["made for a test"])
    back = load_fibre(path)
    assert back == replace(fibre, path=path, available_models=(fibre.model,))


def test_every_set_says_where_it_comes_from(tmp_path: Path) -> None:
    fibre = load_fibre("18Dec2017a")
    other = load_fibre("18Dec2017a", "2state")
    sets = {"3state_coop": fibre.values, "2state": other.values}
    path = tmp_path / "f.yaml"
    path.write_text(fibre_text(fibre, sets, {"2state": "fitted"}))
    assert load_fibre(path, "2state").source == "fitted"
    assert load_fibre(path, "2state_rigid").source == "fitted"
    assert load_fibre(path).source == fibre.source


def test_the_file_is_one_of_ros_parameters(tmp_path: Path) -> None:
    write_fibre(tmp_path / "f.yaml", load_fibre("18Dec2017a", "hill_se"))
    tree = yaml.safe_load((tmp_path / "f.yaml").read_text())
    assert list(tree) == ["/**"]
    assert set(tree["/**"]["ros__parameters"]["models"]) == {"hill_se"}


def test_a_set_that_would_not_come_back_is_not_written(tmp_path: Path) -> None:
    fibre = load_fibre("18Dec2017a")
    broken = replace(fibre, values=MappingProxyType({**fibre.values, "koff": -1.0}))
    with pytest.raises(UserError, match="koff"):
        write_fibre(tmp_path / "f.yaml", broken)
    assert list(tmp_path.iterdir()) == []
