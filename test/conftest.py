"""Places that many tests need."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

# The first example of a test may compile a model; a slow machine is no error either.
settings.register_profile("patient", deadline=None)
settings.load_profile("patient")


@pytest.fixture(scope="session")
def repo_root() -> Path:
    """The folder of the repository."""
    return Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def shared_data(repo_root: Path) -> Path:
    """Recordings and tables that are kept beside the repository; tests that need them are skipped without."""
    folder = repo_root.parent / "shared" / "data"
    if not folder.is_dir():
        if os.environ.get("XB_MUSCLE_REQUIRE_SHARED_DATA"):
            pytest.fail(f"no recordings at {folder}, and this run must not go without them")
        pytest.skip(f"no recordings at {folder}")
    return folder
