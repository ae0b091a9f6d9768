"""Default, groups and muscles of a table, in that order; what is wrong with one is said in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.plant.mjcf.table import Choice, choices

NAMES = ("soleus_r", "soleus_l", "tibant_r", "tibant_l")


def test_without_a_table_all_are_alike() -> None:
    assert choices(None, NAMES) == [Choice()] * 4


def test_groups_change_the_default_in_turn_and_muscles_come_last(tmp_path: Path) -> None:
    path = tmp_path / "leg.yaml"
    path.write_text(
        """
default: {model: 2state_coop_slack, parameters: {smoothing: 0}}
groups:
  "soleus_*": {fibre: 13Dec2017a, parameters: {f: 60}}
  "*_l": {tendon: elastic, parameters: {f: 70}}
muscles:
  soleus_l: {parameters: {f: 80}}
""",
        encoding="utf-8",
    )
    right, left, other, elastic = choices(path, NAMES)
    assert right == Choice("13Dec2017a", "2state_coop_slack", None, "rigid", {"smoothing": 0, "f": 60})
    assert left == Choice("13Dec2017a", "2state_coop_slack", None, "elastic", {"smoothing": 0, "f": 80})
    assert other == Choice("18Dec2017a", "2state_coop_slack", None, "rigid", {"smoothing": 0})
    assert elastic == Choice("18Dec2017a", "2state_coop_slack", None, "elastic", {"smoothing": 0, "f": 70})


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"defaults": {}}, r"table: key 'defaults' is not known; did you mean 'default'\?"),
        ({"default": {"fiber": "x"}}, r"table, default: key 'fiber' is not known; did you mean 'fibre'\?"),
        ({"default": "3state_coop"}, r"table, default is '3state_coop'; needed are some of the keys fibre, model"),
        ({"groups": {"soles_*": {}}}, r"table: group 'soles_\*' matches none of the 4 muscles"),
        ({"groups": ["soleus"]}, r"table: 'groups' is \['soleus'\]; needed are entries"),
        ({"muscles": {"soleus": {}}}, r"table: the model has no muscle 'soleus'; did you mean 'soleus_[rl]'\?"),
        (
            {"default": {"tendon": "stiff"}},
            r"tendon 'stiff' is not known; allowed are rigid and elastic",
        ),
        ({"default": {"model": 3}}, r"table, default: model is 3; needed is text"),
        ({"muscles": {"soleus_r": {"parameters": [1]}}}, r"muscle soleus_r: parameters are \[1\]; needed are values"),
    ],
)
def test_what_is_wrong_is_named(table: dict[str, Any], said: str) -> None:
    with pytest.raises(UserError, match=said):
        choices(table, NAMES)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("default: {}\ndefault: {}", "is not valid YAML: key 'default' is there twice, on line 1 and on line 2"),
        ("default: {", "is not valid YAML"),
        ("- soleus", "holds a list"),
        (None, "cannot be read"),
    ],
)
def test_files_that_hold_no_table(tmp_path: Path, text: str | None, said: str) -> None:
    path = tmp_path / "leg.yaml"
    if text is not None:
        path.write_text(text, encoding="utf-8")
    with pytest.raises(UserError, match=rf"table {path} {said}") as error:
        choices(path, NAMES)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("le\0g.yaml", r"table le\x00g.yaml cannot be read: embedded null byte"),
        ({"muscles": {"sol\0eus_r": {}}}, r"table: the model has no muscle 'sol\x00eus_r'; did you mean 'soleus_r'?"),
    ],
)
def test_names_with_a_nul_are_one_printable_line(table: Any, said: str) -> None:
    with pytest.raises(UserError) as error:
        choices(table, NAMES)
    assert str(error.value) == said


@pytest.mark.parametrize("table", [5, ["soleus_r"]])
def test_what_is_no_table_is_named(table: Any) -> None:
    with pytest.raises(UserError, match=r"table is of type (int|list); needed is a YAML file or the mapping"):
        choices(table, NAMES)
