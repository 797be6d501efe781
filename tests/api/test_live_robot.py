"""A robot on the bus, from Python: a real process over real Zenoh."""

import asyncio
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress

import pytest

import touchline
from tests.meeting import eventually
from touchline.bus.ports import free_port
from touchline.schemas.bus_variables import ENDPOINT_VARIABLE

START_S = 120.0
pytestmark = pytest.mark.xdist_group("live robot")  # by one worker, so that it is started once


@pytest.fixture(scope="module")
def emulated() -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """Meeting point and process of an emulated robot that drives as fast as it can; the last test kills it."""
    place = f"tcp/127.0.0.1:{free_port()}"
    process = subprocess.Popen(
        [sys.executable, "-m", "touchline", "robot-sim", "--speed", "max"], env={**os.environ, ENDPOINT_VARIABLE: place}
    )
    try:
        yield place, process
    finally:
        process.terminate()
        process.wait(30.0)


@pytest.fixture(scope="module")
def endpoint(emulated: tuple[str, subprocess.Popen[bytes]]) -> str:
    return emulated[0]


@pytest.fixture(scope="module")
def plan() -> touchline.Plan:
    return touchline.plan("study-square")


def test_a_plan_is_loaded_driven_and_followed(endpoint: str, plan: touchline.Plan) -> None:
    with touchline.connect("tt2", endpoint=endpoint, timeout_s=START_S) as robot:
        assert robot.state == "idle"
        with pytest.raises(touchline.CommandRefused):
            robot.start()
        assert robot.load(plan) == pytest.approx(plan.duration_s)
        assert robot.wait("ready", timeout_s=START_S).total_length_m == pytest.approx(plan.length_m)
        robot.start()
        for status in robot.subscribe("traversal/status", timeout_s=START_S):
            if status.arc_length_m > 1.0:  # type: ignore[attr-defined]
                break
        assert robot.wait(timeout_s=START_S).state == status.DONE  # type: ignore[attr-defined]
        # The last stroke ends at the corner of the square.
        end_x_m = plan.path()["x_m"][-1]  # the status overtakes the estimate
        assert eventually(lambda: abs(robot.estimate.pose.pose.position.x - end_x_m) < 0.05)


def test_orders_stop_a_robot_and_go_on(endpoint: str, plan: touchline.Plan) -> None:
    with touchline.connect("tt2", endpoint=endpoint, timeout_s=START_S) as robot:
        robot.set_pace(1.0)
        robot.load(plan)
        robot.start()
        robot.wait("running", timeout_s=START_S)
        robot.pause()
        assert robot.wait("paused", timeout_s=START_S).reason
        robot.resume()
        robot.wait("running", timeout_s=START_S)
        robot.fault({"kind": "gnss-outage", "duration_s": 0.5})
        with pytest.raises(touchline.SpecError, match="kind"):
            robot.fault({"kind": "gnss-outtage"})
        robot.estop()
        robot.wait("emergency-stopped", timeout_s=START_S)
        with pytest.raises(touchline.CommandRefused, match="reset again if it is safe"):
            robot.reset()
        deadline = time.monotonic() + START_S
        while robot.state == "emergency-stopped" and time.monotonic() < deadline:
            with suppress(touchline.CommandRefused):
                robot.reset()
        robot.abort()
        robot.wait("aborted", timeout_s=START_S)
        robot.set_pace(-1.0)


def test_an_async_robot_does_the_same(endpoint: str, plan: touchline.Plan) -> None:
    async def drive() -> tuple[float, int]:
        async with await touchline.connect_async("tt2", endpoint=endpoint, timeout_s=START_S) as robot:
            seconds = await robot.load(plan)
            await robot.order("start")
            return seconds, (await robot.wait("done", timeout_s=START_S)).state

    seconds, state = asyncio.run(drive())
    assert seconds == pytest.approx(plan.duration_s) and state == 4


def test_a_robot_that_is_not_there_is_named_with_the_remedy(endpoint: str) -> None:
    with pytest.raises(touchline.RobotUnavailable, match=r"robot tt9 is not on the bus .* `touchline up`") as caught:
        touchline.connect("tt9", endpoint=endpoint, timeout_s=0.5)
    assert caught.value.field == "tt9" and isinstance(caught.value, TimeoutError)


def test_a_topic_that_is_none_is_named_with_the_right_one(endpoint: str) -> None:
    with (
        touchline.connect("tt2", endpoint=endpoint, timeout_s=START_S) as robot,
        pytest.raises(touchline.SpecError, match="did you mean 'traversal/status'"),
    ):
        robot.subscribe("traversal/state")


def test_an_async_robot_is_stopped_though_another_call_waits_and_missed_when_it_leaves(
    emulated: tuple[str, subprocess.Popen[bytes]],
) -> None:
    async def stop(place: str, process: subprocess.Popen[bytes]) -> None:
        async with await touchline.connect_async("tt2", endpoint=place, timeout_s=START_S) as robot:
            async with robot._lock:  # held as by a call that takes long
                await robot.order("estop")
            assert (await robot.wait("emergency-stopped", timeout_s=START_S)).state == 6
            async for status in robot.subscribe("traversal/status", timeout_s=START_S):
                assert status.state == 6  # type: ignore[attr-defined]
                break
            process.kill()
            with pytest.raises(touchline.RobotUnavailable, match="has left the bus"):
                await robot.wait("done")

    asyncio.run(stop(*emulated))
