"""Fibre files: what ships, what is refused, and in which words."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import fibre_from_parameters, find_fibre_file, load_fibre
from xb_muscle_ros.models.parameters import PARAMETERS
from xb_muscle_ros.models.registry import BASE_OF, model_of_set

FIBRES = ("13Dec2017a", "13Dec2017b", "14Dec2017b", "18Dec2017a", "18Dec2017b", "19Dec2017a", "7Aug2018a")
SETS = {
    "3state_coop": "3state_coop",
    "3state_coop_v3": "3state_coop_v3",
    "2state": "2state_xb",
    "4state_coop": "4state_coop",
    "hill_se": "hill_se",
}
# Sets that nobody released, fitted here; fibres without released sets have these alone.
FITTED = {"2state_coop", "hill"}
FITTED_ONLY = ("12Dec2017a", "14Dec2017a", "6Aug2018a", "6Aug2018b")


@pytest.mark.parametrize("fibre", FIBRES)
@pytest.mark.parametrize("model", SETS)
def test_shipped_values_are_the_released_ones(shared_data: Path, fibre: str, model: str) -> None:
    released = json.loads((shared_data / "parameters.json").read_text())[SETS[model]][fibre]
    values = dict(load_fibre(fibre, model).values)
    assert values.pop("smoothing") == released["K"] == 100.0
    assert values.pop("smooth_stiffness") == (1.0 if model in ("3state_coop_v3", "4state_coop") else 0.0)
    assert values.pop("tau_act", 0.005) == 0.005
    assert values.pop("steepness", 3.0) == 3.0
    if model == "hill_se":
        assert [values.pop(name) for name in ("e1", "e2", "e3", "e4")] == released["e"]
    assert values == {name: released[name] for name in values}


@pytest.mark.parametrize("fibre", FIBRES)
def test_defaults_and_contents(fibre: str) -> None:
    loaded = load_fibre(fibre)
    assert loaded.name == fibre
    assert loaded.model == "3state_coop"
    assert set(loaded.available_models) == {*SETS, *FITTED}
    assert "van der Zee" in loaded.source


@pytest.mark.parametrize("fibre", [*FIBRES, *FITTED_ONLY])
def test_fitted_sets_say_that_they_are(fibre: str) -> None:
    for model in FITTED:
        loaded = load_fibre(fibre, model)
        assert loaded.source.startswith("fitted by this package to ")
        assert "not released" in loaded.source
        assert loaded.values["smoothing"] == 0.0
        assert "van der Zee" not in loaded.source


@pytest.mark.parametrize("fibre", FITTED_ONLY)
def test_fibres_without_released_sets(fibre: str) -> None:
    loaded = load_fibre(fibre)
    assert set(loaded.available_models) == FITTED
    with pytest.raises(UserError, match="no parameter set here"):
        load_fibre(fibre, "3state_coop")


def text(**changes: object) -> str:
    tree = yaml.safe_load(find_fibre_file("18Dec2017a").read_text())
    inner = tree["/**"]["ros__parameters"]
    for key, value in changes.items():
        *branches, leaf = key.split("__")
        branch = inner
        for name in branches:
            branch = branch[name]
        if value is None:
            del branch[leaf]
        else:
            branch[leaf] = value
    return yaml.safe_dump(tree)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"models__3state_coop__kon": -1.0}, r"'kon' is -1 1/\(µM s\); allowed is 0 to 10000 1/\(µM s\)"),
        ({"models__3state_coop__kon": float("nan")}, "'kon' is nan"),
        ({"models__3state_coop__kon": float("inf")}, "'kon' is inf"),
        ({"models__3state_coop__kon": "much"}, "'kon' is 'much', not a number"),
        ({"models__3state_coop__kon": True}, "'kon' is True, not a number"),
        ({"models__3state_coop__konn": 1.0}, "'konn' is not known; did you mean 'kon'?"),
        ({"models__3state_coop__kappa": 1.0}, "model 3state_coop has no parameter 'kappa'"),
        ({"models__3state_coop__kon": None}, "needs parameter 'kon'"),
        ({"models__3state_cop": {"f": 1.0}}, "'3state_cop' is not known; did you mean '3state_coop'?"),
        ({"modell": "3state_coop"}, "'modell' is not known; did you mean 'model'?"),
        (
            {"model": "2state_coop", "models__2state_coop": None},
            "model '2state_coop' has no parameter set here; there are 2state, 3state_coop",
        ),
        (
            {"model": "2state_coop_rigid", "models__2state_coop": None},
            "'2state_coop_rigid' has no parameter set here, nor has '2state_coop'; there are",
        ),
        (
            {"model": "3state_coop_rigid_v9"},
            "'3state_coop_rigid_v9' has no parameter set here, nor has '3state_coop_v9'",
        ),
        ({"model": "4state"}, "model '4state' is not known"),
        ({"model": "3state_coop_v3_rigid"}, "'3state_coop_v3_rigid' is not known; did you mean '3state_coop_rigid'?"),
        (
            {"models__3state_coop_rigid": {"kse": 0.3}, "model": "3state_coop_rigid"},
            "model 3state_coop_rigid has no parameter 'kse'",
        ),
        ({"method": "gausian"}, "'gausian' is not known; did you mean 'gaussian'?"),
        ({"fibre": None}, "'fibre' is missing"),
        ({"constants__f0_n": 0.0}, "'f0_n' is 0 N"),
        ({"constants__length": 1.0}, "'length' is not known"),
    ],
    ids=lambda x: x if isinstance(x, str) else None,
)
def test_what_is_wrong_is_named(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    file = tmp_path / "fibre.yaml"
    file.write_text(text(**changes))
    with pytest.raises(UserError, match=message) as caught:
        load_fibre(file)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", ["", "- 1", "/**: 3", "/**:\n  ros__parameters: 4", "a: [1", "\x00"])
def test_malformed_files_are_one_line(tmp_path: Path, content: str) -> None:
    file = tmp_path / "fibre.yaml"
    file.write_text(content)
    with pytest.raises(UserError) as caught:
        load_fibre(file)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("variant", "base", "left_out", "added"),
    [
        ("3state_coop_rigid", "3state_coop", {"kse", "kse0", "smooth_stiffness"}, {}),
        ("3state_coop_softplus", "3state_coop", {"Fpe0"}, {"lpe0": 0.0, "pe_sharpness": 100.0}),
        ("3state_coop_rigid_v3", "3state_coop_v3", {"kse", "kse0", "smooth_stiffness"}, {}),
        (
            "2state_rigid_softplus",
            "2state",
            {"kse", "kse0", "smooth_stiffness", "Fpe0"},
            {"lpe0": 0.0, "pe_sharpness": 100.0},
        ),
        ("hill", "hill_se", {"kse", "kse0", "smooth_stiffness"}, {}),
        (
            "hill_softplus",
            "hill_se",
            {"kse", "kse0", "smooth_stiffness", "Fpe0"},
            {"lpe0": 0.0, "pe_sharpness": 100.0},
        ),
    ],
    ids=lambda x: x if isinstance(x, str) else "",
)
def test_variants_use_the_set_of_their_base(
    tmp_path: Path, variant: str, base: str, left_out: set[str], added: dict[str, float]
) -> None:
    # Hill without series element has a set of its own in the package's files.
    file = tmp_path / "fibre.yaml"
    file.write_text(text(models__hill=None))
    fibre = load_fibre(file, variant)
    wanted = {k: v for k, v in load_fibre("18Dec2017a", base).values.items() if k not in left_out}
    assert dict(fibre.values) == {**wanted, **added}
    assert fibre.model == variant
    assert set(fibre.available_models) == {*SETS, *FITTED} - {"hill"}


def test_a_variants_own_set_needs_to_name_what_differs_only(tmp_path: Path) -> None:
    file = tmp_path / "fibre.yaml"
    file.write_text(text(models__3state_coop_softplus={"lpe0": 0.02, "f": 60.0}))
    values = load_fibre(file, "3state_coop_softplus").values
    assert (values["lpe0"], values["f"]) == (0.02, 60.0)
    assert values["kon"] == load_fibre(file, "3state_coop").values["kon"]


def test_unknown_fibre_suggests_the_nearest() -> None:
    with pytest.raises(UserError, match="did you mean '18Dec2017a'"):
        load_fibre("18Dec2017aa")


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"none\.yaml does not exist"):
        load_fibre(tmp_path / "none.yaml")


@pytest.mark.slow
@given(
    st.dictionaries(
        st.one_of(st.text(max_size=20), st.sampled_from(["fibre", "model", "models.3state_coop.f", "constants.f0_n"])),
        st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5), st.lists(st.integers())),
        max_size=6,
    )
)
def test_any_parameters_either_make_a_fibre_or_a_user_error(parameters: dict[str, object]) -> None:
    try:
        fibre = fibre_from_parameters(parameters, "test")
    except UserError as error:
        lines = str(error).count("\n")
    else:
        lines = 0
        assert BASE_OF[model_of_set(fibre.model)] in {model_of_set(name) for name in fibre.available_models}
    assert lines == 0


def test_every_row_of_the_table_is_complete() -> None:
    for name, row in PARAMETERS.items():
        assert row.name == name
        assert row.unit
        assert row.meaning
        assert row.source
        assert row.lower < row.upper
        assert row.default is None or row.lower <= row.default <= row.upper


def test_values_supply_what_a_swapped_block_lacks() -> None:
    """The set of `2state` knows nothing of the thick filament's feedback."""
    model = "2state+thick_filament_cooperativity"
    with pytest.raises(UserError, match=r"needs parameter 'JF'.*add it to the set, or to --set"):
        load_fibre("18Dec2017a", model)
    bare, fibre = load_fibre("18Dec2017a", "2state"), load_fibre("18Dec2017a", model, values={"JF": 2.0, "f": 95.0})
    assert (fibre.values["JF"], fibre.values["f"], fibre.values["kse"]) == (2.0, 95.0, bare.values["kse"])
    with pytest.raises(UserError, match="--set: parameter 'JF' is -1"):
        load_fibre("18Dec2017a", model, values={"JF": -1.0})


def test_a_parameter_that_is_there_twice_is_refused(tmp_path: Path) -> None:
    """The last one would win without a word."""
    text = find_fibre_file("18Dec2017a").read_text(encoding="utf-8")
    path = tmp_path / "twice.yaml"
    path.write_text(text.replace("\n        f: ", "\n        f: 1.0\n        f: ", 1), encoding="utf-8")
    with pytest.raises(UserError, match=r"not valid YAML: key 'f' is there twice, on line \d+ and on line \d+; mend"):
        load_fibre(path)
