"""Places that many tests need."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
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


@pytest.fixture(scope="session")
def shared_cases(shared_data: Path) -> Path:
    """Small inputs with faults that users met, kept beside the recordings; tests that need them are skipped without."""
    folder = shared_data.parent / "cases"
    if not folder.is_dir():
        if os.environ.get("XB_MUSCLE_REQUIRE_SHARED_DATA"):
            pytest.fail(f"no cases at {folder}, and this run must not go without them")
        pytest.skip(f"no cases at {folder}")
    return folder


@pytest.fixture(scope="session")
def new_domain() -> Iterator[Callable[[], int]]:
    """Gives ROS domains of this test run's own, on this machine only; tests that need one are skipped without ROS."""
    try:
        import rclpy  # noqa: F401
    except ImportError as error:
        if os.environ.get("CI"):
            raise
        pytest.skip(f"ROS 2 cannot be imported: {error}")
    from xb_muscle_ros.node.client.process import private_domain

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        yield private_domain
