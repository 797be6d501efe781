"""Tasks of a team over Zenoh: as simulated, and with requests of another process while it runs."""

from __future__ import annotations

import json
import uuid
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.meeting import eventually
from tests.system.commands import figures, start_touchline, touchline, touchline_here
from touchline.bus import Bus, BusConfig, CallError
from touchline.recordings.reader import RecordingReader
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.messages import String, TeamTaskRequest

TEAM = {"area": {"outline": [(0, 0), (5, 0), (5, 5), (0, 5)]}, "robots": 2}
REQUESTS = {
    "requests": [
        {"id": "there", "category": "go_to_place", "place": [4, 1], "dwell_s": 1},
        {"id": "later", "category": "go_to_place", "place": [1, 4], "earliest_start_s": 9000},
    ],
    "places": {"door": [4, 4]},
    "docks": {"corner": {"x_m": 0.5, "y_m": 4.5, "power_w": 4000.0}},
    "charges": {"tb2": 0.15},
    "recharge_soc": 0.3,
}
ADDED = {"requests": [{"id": "more", "category": "delivery", "pickup": [3, 3], "dropoff": [4, 4], "pickup_s": 1}]}


def files(folder: Path, duration_s: float, *, ends: bool) -> tuple[str, ...]:
    team, requests = folder / "team.json", folder / "requests.json"
    team.write_text(json.dumps(TEAM | {"duration_s": duration_s}))
    requests.write_text(json.dumps(REQUESTS | {"ends": ends}))
    return "fleet", "dispatch", str(requests), "--team", str(team), "--json"


def tasks(run: dict[str, Any]) -> dict[str, str]:
    return {each["id"]: each["state"] for each in run["dispatch"]["tasks"]}


@pytest.mark.full
def test_tasks_over_the_bus_are_done_as_in_the_simulation(tmp_path: Path) -> None:
    recording, told = tmp_path / "team.mcap", files(tmp_path, 30.0, ends=False)
    simulated = json.loads(touchline_here(*told).stdout)
    driven = json.loads(touchline(*told, "--bus", "--record", str(recording)).stdout)
    assert driven["dispatch"] == simulated["dispatch"]
    assert tasks(driven) == {"there": "completed", "later": "dispatched", "charge-1": "completed"}
    assert not driven["success"]  # one task has not begun
    told_by = f"/{topics.TEAM_NAMESPACE}/{topics.TEAM_QUEUE.name}"
    *_, last = (each for each in RecordingReader(recording).messages() if each.topic == told_by)
    assert json.loads(decode(String, last.payload).data)["tasks"] == driven["dispatch"]["tasks"]


def test_another_process_adds_and_cancels_tasks(bus_config: BusConfig, tmp_path: Path) -> None:
    more, log = tmp_path / "more.json", tmp_path / "run.json"
    more.write_text(json.dumps(ADDED))
    ask = ("fleet", "dispatch", "--json")
    process = start_touchline(*files(tmp_path, 10_000.0, ends=True), "--bus", config=bus_config, log=log)
    try:
        with Bus.open(topics.OPERATOR, replace(bus_config, namespaces=(topics.TEAM_NAMESPACE,))) as bus:
            assert eventually(lambda: begun(bus), 120.0)
        assert figures(touchline_here(*ask, "--add", str(more), config=bus_config))["message"] == "added: more"
        queue = figures(touchline_here(*ask, "--queue", config=bus_config))
        assert queue["tasks"][1]["state"] in ("dispatched", "selected")
        canceled = figures(touchline_here(*ask, "--cancel", "later", config=bus_config))
        assert canceled["message"] == "later: canceled on request"  # nothing is left then, and the run ends
        assert process.wait(120.0) == 0, log.read_text()
    finally:
        process.kill()
        process.wait()
    done = json.loads(log.read_text()[log.read_text().index("{") :])
    assert done["success"], done["reason"]
    assert {name: state for name, state in tasks(done).items() if not name.startswith("charge")} == {
        "there": "completed",
        "later": "canceled",
        "more": "completed",
    }


def begun(bus: Bus) -> bool:
    try:
        return bus.call(topics.TEAM_REQUESTS, TeamTaskRequest(request_id=uuid.uuid4().hex, task_json="{}"), 5.0).success
    except CallError:
        return False
