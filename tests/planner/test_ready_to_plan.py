"""A planner that has said that it is ready compiles nothing any more for vehicles of the kinds that it knows."""

import subprocess
import sys

import pytest

from touchline.schemas.vehicles.shipped import SHIPPED


@pytest.mark.parametrize(
    "vehicle",
    [name if name == "turf-tank-two" else pytest.param(name, marks=pytest.mark.full) for name in SHIPPED],
)
def test_nothing_is_prepared_for_a_request_after_the_warm_up(vehicle: str) -> None:
    command = [sys.executable, "-m", "tests.planner.every_request", vehicle]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300.0)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == ""
