"""A drive to a goal behind walls that no plan knows, by planner, robot and bridge as processes of their own."""

import json
from pathlib import Path

import pytest

from tests.meeting import eventually
from tests.system.commands import figures, start_touchline, touchline_here
from tests.way_round.met import LIDAR
from tests.way_round.walls import wall
from touchline.bus import Bus, BusConfig
from touchline.checking.check_files import check_file
from touchline.schemas import topics
from touchline.schemas.messages import RecordRequest, RecordStopRequest

SHORT_SIGHTED = {**LIDAR, "max_m": 4.0, "dark_m": 4.0}


@pytest.mark.full
def test_the_robot_leaves_a_dead_end_and_reaches_its_goal(tmp_path: Path, bus_config: BusConfig) -> None:
    vehicle, world, record, log = (tmp_path / name for name in ("marker.json", "world.json", "goal.mcap", "up.log"))
    vehicle.write_text(json.dumps({"name": "marker", "sensors": [SHORT_SIGHTED], "protection": {"mode": "protect"}}))
    walls = wall((2.0, 2.0), (9.0, 2.0), (9.0, -2.0), (2.0, -2.0))
    start = {"x_m": 0.0, "y_m": 0.0, "heading_rad": 0.0}
    world.write_text(json.dumps({"seed": 5, "start": start, "objects": walls}))
    robot = ("--vehicle", str(vehicle), "--scenario", str(world), "--speed", "max", "--recordings", str(tmp_path))
    up = start_touchline("up", *robot, config=bus_config, log=log)
    try:
        assert eventually(lambda: "is up" in log.read_text(), 300.0)
        with Bus.open("bystander", bus_config) as bus:
            assert bus.call(topics.RECORD, RecordRequest(request_id="record", path=str(record)), 60.0).success
            told = figures(touchline_here("goto", "12", "0", "--json", config=bus_config))
            assert bus.call(topics.RECORD_STOP, RecordStopRequest(request_id="stop"), 60.0).success
    finally:
        up.terminate()
        up.wait(60.0)
    assert told["success"], told["reason"]
    assert told["drives"] > 1 and "contacts" not in told
    assert told["arrival"]["true"]["off_m"] < 0.05
    (verdict,) = check_file("", record)
    assert verdict.passed, verdict
