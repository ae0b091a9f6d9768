"""Parameter files of a body's fibres."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import yaml

from xb_muscle_ros.models.fibre_file import changed, load_fibre
from xb_muscle_ros.node.configuration import configure_many
from xb_muscle_ros.plant.node_file import write_node_file


def flat(tree: dict[str, object], above: str = "") -> dict[str, object]:
    """As ROS names what a parameter file nests."""
    made: dict[str, object] = {}
    for name, value in tree.items():
        made.update(flat(value, f"{above}{name}.") if isinstance(value, dict) else {f"{above}{name}": value})
    return made


def test_a_node_makes_the_same_fibres_of_it_to_the_bit(tmp_path: Path) -> None:
    file = load_fibre("18Dec2017a", "3state_coop")
    fibres = [
        replace(changed(file, {"f": 60.1 + 0.1 * k, "kpe": 0.0}, "test"), name=name, f0_n=900.0 / (k + 3.0))
        for k, name in enumerate(("soleus_r", "soleus_l", "gasmed_r"))
    ]
    write_node_file(tmp_path / "leg.yaml", fibres, "18Dec2017a", "lockstep")
    given = flat(yaml.safe_load((tmp_path / "leg.yaml").read_text())["/**"]["ros__parameters"])
    assert (given.pop("mode"), given["model"], given.pop("method")) == ("lockstep", "3state_coop", "gaussian")
    names, source = given.pop("fibers"), str(given.pop("fiber_file"))
    assert isinstance(names, list)
    made = configure_many(names, [source] * 3, given)
    for fibre in fibres:
        found = made[fibre.name].fibre
        assert found.values == fibre.values
        assert (found.f0_n, found.reference_length_m) == (fibre.f0_n, fibre.reference_length_m)
    # What all have in common stands once.
    assert sum(name.endswith(".kpe") for name in given) == 1
    assert sum(name.endswith(".f") for name in given) == 3
