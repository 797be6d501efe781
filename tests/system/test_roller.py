"""A small pan rolled by real processes over real Zenoh: killed on the way, all of it is rolled."""

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from touchline.bus import Bus
from touchline.jobs.single.recorded_paint import read_painted
from touchline.schemas import topics
from touchline.schemas.messages import (
    AreaReport,
    CommandRequest,
    GetDiagnosticsRequest,
    LoadRequest,
    PlanOptions,
    PlanRequest,
    RecordRequest,
    RecordStopRequest,
    SetSpeedRequest,
    Trajectory,
    TraversalStatus,
)
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.template import Area, Polygon, Template
from touchline.schemas.vehicles.shipped import CLAY_ROLLER
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.telemetry import Telemetry
from touchline.supervision.temporary_system import LocalSystem, ProcessOptions, local_system

CORNERS = ((0.0, 0.0), (18.0, 0.0), (18.0, 9.0), (0.0, 9.0))
ROOM = ((-9.0, -9.0), (27.0, -9.0), (27.0, 18.0), (-9.0, 18.0))
PAN = Template(name="small-pan", areas=(Area(id="pan", outline=CORNERS),), boundary=Polygon(id="room", corners=ROOM))
TEXT = PAN.model_dump_json()
ZIGZAG = PlanOptions(area_method="zigzag")
"""Planned in no time, and every other lane is driven backward."""
SETUP = Setup(
    vehicle=CLAY_ROLLER,
    scenario=Scenario(seed=2, ground={"surface": "clay"}),
    onboard=OnboardConfig(follower="pure-pursuit"),
)
UNDER_WAY = (TraversalStatus.IDLE, TraversalStatus.READY, TraversalStatus.RUNNING)


class Farmer:
    """Gives orders, and looks at what the robot believes."""

    def __init__(self, bus: Bus) -> None:
        self.bus, self.status, self.orders = bus, TraversalStatus(), 0
        self._inbox = bus.inbox([topics.STATUS], keep="latest")

    def order(self, topic, request=CommandRequest, **more):
        self.orders += 1
        answer = self.bus.call(topic, request(request_id=str(self.orders), **more), 200.0)
        assert answer.success, answer.message
        return answer

    def until(self, condition: Callable[[TraversalStatus], bool]) -> TraversalStatus:
        deadline = time.monotonic() + 200.0
        while not condition(self.status):
            assert time.monotonic() < deadline, f"waited too long: {self.status}"
            time.sleep(0.002)
            for _, status in self._inbox.messages():
                self.status = status
        return self.status

    def sim_time_s(self) -> float:
        """By the robot's clock, now; what it has said before may be on the way for longer."""
        robot = topics.diagnostics_service(topics.ROBOT_SIM)
        (status,) = self.bus.call(robot, GetDiagnosticsRequest(), 200.0).diagnostics.status
        return float(next(value.value for value in status.values if value.key == "sim_time_s"))

    def rolls_on_from(self, arc_m: float) -> None:
        now = self.until(lambda it: it.arc_length_m > arc_m + 1.0 or it.state not in UNDER_WAY)
        assert now.state == TraversalStatus.RUNNING, now.reason


def kill_robot(system: LocalSystem, farmer: Farmer) -> None:
    pid = system.supervisor.pid(topics.ROBOT_SIM)
    os.kill(pid, signal.SIGKILL)
    notices = []
    while not any(notice.kind == "restarted" for notice in notices):
        notices += system.poll()
        time.sleep(0.01)
    farmer.until(lambda it: it.state == TraversalStatus.IDLE)


def undisturbed(trajectory: Trajectory) -> AreaReport:
    emulator = Emulator(SETUP.vehicle, SETUP.scenario, SETUP.onboard)
    telemetry = Telemetry(emulator)
    emulator.load(trajectory, PAN)
    emulator.start()
    FastRunner(emulator).run(200_000)
    report = telemetry.reports().area
    assert report is not None
    return report


@pytest.mark.full
def test_a_roller_that_is_killed_misses_nothing(tmp_path: Path) -> None:
    recording = tmp_path / "pan.mcap"
    with local_system({"tt2": SETUP}, options=ProcessOptions(recordings=tmp_path)) as system:
        system.wait_until_ready(lambda doing: None)
        farmer, reports = Farmer(system.bus), system.bus.inbox([topics.AREA_REPORT])
        plan = farmer.order(topics.PLAN_SERVICE, PlanRequest, template_json=TEXT, options=ZIGZAG).trajectory
        load = {"trajectory": plan, "template_json": TEXT}
        farmer.order(topics.RECORD, RecordRequest, path=str(recording))
        farmer.order(topics.LOAD, LoadRequest, **load)
        farmer.order(topics.SET_SPEED, SetSpeedRequest, factor=20.0)
        farmer.order(topics.START)
        farmer.until(lambda it: it.speed_mps < -0.5)
        farmer.order(topics.SET_SPEED, SetSpeedRequest, factor=1.0)  # it gets not far until it is killed
        slowed_s = farmer.sim_time_s()
        before = farmer.until(lambda it: it.header.stamp.sec >= slowed_s)
        kill_robot(system, farmer)
        farmer.order(topics.LOAD, LoadRequest, resume=True, **load)
        after = farmer.until(lambda it: it.state == TraversalStatus.READY)
        assert before.coverage_pct <= after.coverage_pct < before.coverage_pct + 10.0
        farmer.order(topics.SET_SPEED, SetSpeedRequest, factor=20.0)
        farmer.order(topics.START)
        farmer.rolls_on_from(after.arc_length_m)
        farmer.order(topics.SET_SPEED, SetSpeedRequest, factor=-1.0)
        farmer.until(lambda it: it.state == TraversalStatus.DONE)
        said: list[AreaReport] = []
        while not said:
            said += [report for _, report in reports.messages()]
            time.sleep(0.01)
        farmer.order(topics.RECORD_STOP, RecordStopRequest)
    whole = undisturbed(plan)
    # A step in curvature is followed a little beside the path, and after a kill from on it. A metre of a strip that
    # nobody rolled would be 0.6 %.
    assert said[-1].coverage_pct == pytest.approx(whole.coverage_pct, abs=0.5)
    assert said[-1].of_planned_pct == pytest.approx(whole.of_planned_pct, abs=0.5)
    assert said[-1].body_outside_m < 0.01
    recorded = read_painted(recording)
    assert recorded.area == said[-1]
    assert sum(len(stroke.x_m) for stroke in recorded.strokes) < 15_000, "strokes are thinned"
