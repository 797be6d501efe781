"""A recording that several tests check."""

from pathlib import Path

import pytest

from tests.checking.short_sessions import bend


@pytest.fixture(scope="session")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The short session; it is only read."""
    return bend(tmp_path_factory.mktemp("checking") / "bend.mcap")
