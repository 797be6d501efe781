"""A recording that several tests check."""

from pathlib import Path

import pytest

from tests.checking.short_sessions import BRIEF, bend


@pytest.fixture(scope="session")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The short session; it is only read."""
    return bend(tmp_path_factory.mktemp("checking") / "bend.mcap")


@pytest.fixture(scope="session")
def brief(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first seconds of it, in which most differences show; it is only read."""
    return bend(tmp_path_factory.mktemp("checking") / "brief.mcap", BRIEF)
