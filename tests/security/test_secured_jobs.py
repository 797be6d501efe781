"""Jobs of several robots on a secured bus of their own."""

import json
from pathlib import Path

import pytest

from tests.system.commands import figures, touchline, touchline_here
from touchline.recordings.channels import robots_among
from touchline.recordings.reader import RecordingReader

pytestmark = pytest.mark.xdist_group("secured system")

TEAM = ("--robots", "2", "--duration", "2", "--seed", "5", "--json")


@pytest.fixture(autouse=True)
def keys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("CONFIG", "STATE"):
        monkeypatch.setenv(f"XDG_{name}_HOME", str(tmp_path / name))


def test_a_team_has_the_bytes_of_the_simulation() -> None:
    simulated = figures(touchline_here("fleet", "simulate", *TEAM, "--hash"))
    done = figures(touchline("fleet", "run", *TEAM, "--secure"))
    assert done["success"], done["reason"]
    assert done["hash"]["robots"] == simulated["hash"]["robots"]
    assert done["bus"]["lost"] == 0


@pytest.mark.full
def test_robots_that_share_a_job_are_recorded_under_a_seal(tmp_path: Path) -> None:
    lines = {f"row-{k}": {"start": [0, 6 * k], "end": [3, 6 * k]} for k in range(2)}
    template, recording = tmp_path / "rows.json", tmp_path / "both.mcap"
    template.write_text(json.dumps({"name": "rows", "segments": [{"id": k, "line": v} for k, v in lines.items()]}))
    shared = touchline("run", str(template), "--robots", "2", "--secure", "--json", "--record", str(recording))
    assert figures(shared)["success"]
    assert {"r1", "r2"} <= set(robots_among(message.topic for message in RecordingReader(recording).messages()))
    verified = touchline_here("info", "--verify", str(recording))
    assert "as recorded by bridge.main" in verified.stdout
