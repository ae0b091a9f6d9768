"""Which parameter sets there are, in which order, and where they come from."""

from __future__ import annotations

from pathlib import Path

import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.evaluate.sets import gather, rank
from xb_muscle_ros.evaluate.srs_scores import aic_reference
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.plain import fibre_to_plain, muscle_of_plain


def fibre_file(folder: Path, repo_root: Path, name: str, sets: list[str], source: str = "made up") -> Path:
    """A fibre file with some sets of a fibre of the package, under a name of its own."""
    import yaml

    tree = yaml.safe_load((repo_root / "config" / "fibers" / "18Dec2017a.yaml").read_text())
    inner = tree["/**"]["ros__parameters"]
    held = inner["models"]
    hill = {k: v for k, v in held["hill_se"].items() if k not in ("kse", "kse0", "smooth_stiffness")}
    inner["models"] = {key: hill if key == "hill" else held[key] for key in sets}
    inner.update(fibre=name, model=sets[0], source=source, sources={})
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump(tree))
    return path


def test_sets_come_in_order_of_complexity() -> None:
    names = [each.name for each in gather(["18Dec2017a"], None, None)]
    assert names == ["hill_se", "2state", "3state_coop", "3state_coop_v3", "4state_coop"]
    assert [rank(name) for name in ("hill", "2state_coop", "3state_coop_rigid")] == [0, 3, 4]


def test_fitted_parameters_are_those_of_the_papers_methods() -> None:
    counts = {each.name: each.fitted_parameters for each in gather(["18Dec2017a"], None, None)}
    assert counts == {"hill_se": 7, "2state": 10, "3state_coop": 11, "3state_coop_v3": 11, "4state_coop": 12}
    (hill,) = gather(["18Dec2017a"], ["hill"], None)
    assert hill.fitted_parameters == 5


def test_missing_sets_are_named(tmp_path: Path, repo_root: Path) -> None:
    other = fibre_file(tmp_path, repo_root, "other", ["3state_coop"])
    models = {each.name: each for each in gather(["18Dec2017a", other], None, None)}
    assert models["2state"].missing == ("other",)
    assert list(models["2state"].fibres) == ["18Dec2017a"]
    assert models["3state_coop"].missing == ()
    assert models["3state_coop"].provenance()["other"] == "made up"


def test_a_set_of_another_model_is_borrowed_and_says_so(tmp_path: Path, repo_root: Path) -> None:
    (borrowed,) = gather(["18Dec2017a"], ["hill"], None)
    assert borrowed.borrowed_from == "hill_se"
    assert "set of hill_se, not fitted for this model" in borrowed.provenance()["18Dec2017a"]
    own = fibre_file(tmp_path, repo_root, "own", ["hill", "hill_se"], source="fitted here")
    # Where one fibre has a set of its own, the others do not borrow.
    (mixed,) = gather(["18Dec2017a", own], ["hill"], None)
    assert (mixed.borrowed_from, list(mixed.fibres), mixed.missing) == (None, ["own"], ("18Dec2017a",))
    assert mixed.provenance() == {"own": "fitted here"}


def test_what_aics_are_relative_to(tmp_path: Path, repo_root: Path) -> None:
    own = fibre_file(tmp_path, repo_root, "own", ["hill", "hill_se", "2state"])
    assert aic_reference(gather([own], None, None)) == ("hill", "")
    borrowed = aic_reference(gather(["18Dec2017a"], ["hill", "hill_se"], None))
    assert borrowed.model == "hill_se"
    assert "no parameter set of its own" in borrowed.note
    absolute = aic_reference(gather(["18Dec2017a"], ["2state"], None))
    assert absolute.model is None
    assert "absolute" in absolute.note


def test_mistakes_are_named(tmp_path: Path, repo_root: Path) -> None:
    with pytest.raises(UserError, match="fibre 18Dec2017a is given twice"):
        gather(["18Dec2017a", repo_root / "config" / "fibers" / "18Dec2017a.yaml"], None, None)
    with pytest.raises(UserError, match="model '2state_coop': none of the fibres 18Dec2017a has a parameter set"):
        gather(["18Dec2017a"], ["2state_coop"], None)


def test_a_fibre_goes_through_a_task_whole() -> None:
    fibre = gather(["18Dec2017a"], ["3state_coop"], None)[0].fibres["18Dec2017a"]
    muscle = muscle_of_plain(fibre_to_plain(fibre))
    direct = Muscle(fibre)
    assert muscle.parameters.tolist() == direct.parameters.tolist()
    assert muscle_of_plain(fibre_to_plain(fibre)) is muscle
