"""A recording to work on."""

from pathlib import Path

import pytest

from tests.bridge.said import messages, record


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """A finished recording of 2 s."""
    recorder = record(tmp_path / "session.mcap", messages(200))
    report = recorder.finish()
    assert report.problem == ""
    return report.path
