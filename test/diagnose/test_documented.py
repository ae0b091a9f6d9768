"""docs/diagnose.md has every field of the record, every verdict and every mechanism."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest

from xb_muscle_ros.diagnose import component, result
from xb_muscle_ros.diagnose.names import MECHANISMS

_KINDS = {**vars(component), **vars(result)}.values()
_RECORDS = [kind for kind in _KINDS if isinstance(kind, type) and dataclasses.is_dataclass(kind)]


@pytest.fixture(scope="module")
def page(repo_root: Path) -> str:
    return (repo_root / "docs" / "diagnose.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("record", _RECORDS, ids=lambda kind: kind.__name__)
def test_every_field_is_explained(record: type, page: str) -> None:
    fields = [f.name for f in dataclasses.fields(record)]
    assert [name for name in fields if not re.search(rf"[`.]{name}`", page)] == []


def test_every_verdict_and_mechanism_is_there(page: str) -> None:
    names = [*(v.value for v in result.Verdict), *MECHANISMS]
    assert [name for name in names if f"`{name}`" not in page] == []


def test_the_version_is_that_of_the_record(page: str) -> None:
    assert f"\nFormat {result.FORMAT}. " in page
