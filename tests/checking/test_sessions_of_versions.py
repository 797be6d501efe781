"""Sessions of every released version: what a version's recordings can be checked for stays so."""

import re
from pathlib import Path

import pytest

from touchline import Recording
from touchline.checking.check_files import check_file

ROOT = Path(__file__).parents[2]
SESSIONS = sorted((ROOT / "tests" / "sessions").glob("*/*.mcap"))
ONLY_READ = {  # lack the robot's state at the job's begin
    "0.1.0/goto": "had been running for 0.70 s",
    "0.1.0/roller": "had been running for 0.70 s",
}
CHANGED = {  # by a line marked [session]
    "0.1.0/team": "brakes first",
    "0.2.0/goto": "of shape (64, 12)",
    "0.2.0/roller": "of shape (64, 12)",
    "0.2.0/square": "differs first in the estimator",
    "0.2.0/team": "differs first in the estimator",
}
pytestmark = pytest.mark.xdist_group("checking")


def test_every_version_has_its_sessions() -> None:
    versions = re.findall(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.M)
    assert sorted(versions) == sorted({path.parent.name for path in SESSIONS})


@pytest.mark.parametrize("path", SESSIONS, ids=[f"{path.parent.name}/{path.stem}" for path in SESSIONS])
def test_a_session_of_a_version_is_read_and_comes_out_the_same(path: Path) -> None:
    assert path.stat().st_size < 1_000_000
    recording = Recording(path)
    assert recording.made_by["touchline"] == path.parent.name
    assert all(len(recording[name].array()) for name, topic in recording.topics.items() if topic.messages)
    name = f"{path.parent.name}/{path.stem}"
    reason = ONLY_READ.get(name) or CHANGED.get(name)
    for verdict in check_file("", path):
        assert verdict.passed == (reason is None), verdict.lines()
        assert reason is None or reason in "\n".join(verdict.lines())
