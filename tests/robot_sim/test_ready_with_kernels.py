"""A robot that has said that it is ready compiles nothing any more, whatever happens to it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.cdr import encode
from touchline.schemas.messages import LoadRequest, PlanOptions, PlanRequest
from touchline.services.planner.request import answer

LINES = {
    "name": "corner",
    "segments": [
        {"id": "a", "line": {"start": (0, 0), "end": (4, 0)}},
        {"id": "b", "line": {"start": (4, 0), "end": (4, 3)}},
    ],
    "boundary": {"corners": [(-9, -9), (9, -9), (9, 9), (-9, 9)]},
}
AREA = {"name": "lawn", "areas": [{"id": "lawn", "outline": [(0, 0), (12, 0), (12, 12), (0, 12)]}]}


def job(vehicle):
    template = json.dumps(AREA if vehicle.tool.covers else LINES)
    quick = PlanOptions(area_method="zigzag" if vehicle.tool.covers else "")
    planned = answer(PlanRequest(template_json=template, options=quick), vehicle)
    assert planned.success, planned.message
    return LoadRequest(trajectory=planned.trajectory, template_json=template)


LIDAR = "examples/vehicles/marker-lidar.json"
USUAL = ((LIDAR, "mpc"),)
OTHERS = (
    ("clay-roller", "pure-pursuit"),
    ("turf-tank-two", "mpc"),
    ("turtlebot3-waffle-pi", "regularised"),
    ("turf-tank-two", "pure-pursuit"),
    ("clay-roller", "pursuit-lanes"),
    ("turtlebot3-waffle-pi", "dynamic"),
    ("turtlebot3-waffle-pi", "linear"),
    ("turtlebot3-waffle-pi", "frenet"),
    ("turtlebot3-waffle-pi", "linear-scaled"),
    ("turtlebot3-waffle-pi", "nonlinear"),
)


@pytest.mark.parametrize("robots", [USUAL, pytest.param(OTHERS, marks=pytest.mark.full)], ids=["usual", "others"])
def test_nothing_is_prepared_after_the_warm_up(robots, tmp_path):
    command = [sys.executable, "-m", "tests.robot_sim.whole_life"]
    for vehicle, follower in robots:
        path = tmp_path / Path(vehicle).name
        path.write_bytes(encode(job(load_vehicle(vehicle))))
        command += [vehicle, follower, str(path)]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=900.0)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == ""
