"""Killed processes, lost operators, second copies: nothing is lost that need not be, and no valve stays open."""

import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.system.commands import start_touchline, touchline
from touchline.schemas import topics
from touchline.schemas.catalogue import template_text
from touchline.schemas.messages import (
    CommandRequest,
    GetDiagnosticsRequest,
    GetPaintRequest,
    LoadRequest,
    PlanRequest,
    RecordRequest,
    RecordStopRequest,
    SetSpeedRequest,
    SprayerState,
    Trajectory,
    TraversalReport,
    TraversalStatus,
)
from touchline.schemas.messages.base import Message
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles import Vehicle
from touchline.services.bridge.reader import RecordingReader
from touchline.services.bus import Bus, BusConfig
from touchline.services.runs.recorded_paint import read_painted
from touchline.services.system.supervisor import Notice
from touchline.services.system.temporary_system import LocalSystem, ProcessOptions, local_system

TEMPLATE, _ = template_text("soccer-11")
NO_NOISE = Setup(scenario=Scenario(noise="none"))


def wait_until(condition: Callable[[], bool], timeout_s: float = 200.0) -> None:
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, "waited too long"
        time.sleep(0.005)


class Observer:
    """Sees the robot as an operator does."""

    def __init__(self, bus: Bus) -> None:
        self.inbox = bus.inbox([topics.STATUS, topics.SPRAYER], keep="latest")
        self.status, self.sprayer = TraversalStatus(), SprayerState()

    def look(self) -> "Observer":
        for _, message in self.inbox.messages():
            if isinstance(message, TraversalStatus):
                self.status = message
            elif isinstance(message, SprayerState):
                self.sprayer = message
        return self


def start_painting(bus: Bus, speed: float, template: str = TEMPLATE) -> Trajectory:
    plan = bus.call(topics.PLAN_SERVICE, PlanRequest(request_id="plan", template_json=template), 200.0)
    assert plan.success, plan.message
    load = LoadRequest(request_id="load", trajectory=plan.trajectory, template_json=template)
    assert bus.call(topics.LOAD, load, 60.0).success
    assert bus.call(topics.SET_SPEED, SetSpeedRequest(request_id="speed", factor=speed)).success
    assert bus.call(topics.START, CommandRequest(request_id="start")).success
    return plan.trajectory


@pytest.fixture
def painting(tmp_path: Path) -> Iterator[tuple[LocalSystem, Observer, Path]]:
    """A system that paints the pitch at 10x and records, some paint already down."""
    recording = tmp_path / "session.mcap"
    with local_system(
        {"tt2": Setup(scenario=Scenario(noise="none"))}, options=ProcessOptions(recordings=tmp_path)
    ) as system:
        system.wait_until_ready(lambda doing: None)
        assert system.bus.call(topics.RECORD, RecordRequest(request_id="r", path=str(recording))).success
        observer = Observer(system.bus)
        start_painting(system.bus, 10.0)
        wait_until(lambda: observer.look().sprayer.valve_open and observer.status.coverage_pct > 0.5)
        yield system, observer, recording


def kill(system: LocalSystem, node: str) -> list[Notice]:
    """Kill a service; what the supervisor says until it is back on the bus."""
    pid = system.supervisor.pid(node)
    assert pid is not None
    os.kill(pid, signal.SIGKILL)
    notices: list[Notice] = []

    def back() -> bool:
        notices.extend(system.poll())
        return any(n.kind == "restarted" for n in notices) and node in system.presence.alive()

    wait_until(back)
    assert system.supervisor.pid(node) not in (None, pid)
    return [notice for notice in notices if notice.node == node]


def test_the_planner_may_die(painting):
    system, observer, _ = painting
    notices = kill(system, topics.PLANNER)
    assert [notice.kind for notice in notices] == ["died", "restarted"]
    assert "SIGKILL" in notices[0].text
    before = observer.look().status.arc_length_m
    wait_until(lambda: observer.look().status.arc_length_m > before + 5.0)
    assert observer.status.state == TraversalStatus.RUNNING
    again = system.bus.call(topics.PLAN_SERVICE, PlanRequest(request_id="again", template_json=TEMPLATE), 30.0)
    assert again.success


def test_the_robot_may_die_and_comes_back_with_its_valve_closed(painting):
    system, observer, recording = painting
    kill(system, topics.ROBOT_SIM)
    wait_until(lambda: observer.look().status.state == TraversalStatus.IDLE)
    refused = system.bus.call(topics.START, CommandRequest(request_id="restart"))
    assert not refused.success
    start_again = Observer(system.bus)
    wait_until(lambda: start_again.look().status.state == TraversalStatus.IDLE)
    assert not start_again.sprayer.valve_open
    assert any(m.topic.endswith("truth/paint") for m in RecordingReader(recording).messages())


def test_an_emergency_stop_outlives_the_process_that_was_told(painting):
    system, _, _ = painting
    bus = system.bus
    assert bus.call(topics.ESTOP, CommandRequest(request_id="stop")).success
    kill(system, topics.ROBOT_SIM)
    again = Observer(bus)
    wait_until(lambda: again.look().status.state == TraversalStatus.ESTOPPED)
    assert "before the restart" in again.status.reason
    refused = bus.call(topics.START, CommandRequest(request_id="start again"))
    assert not refused.success
    assert "reset" in refused.message
    assert bus.call(topics.RESET, CommandRequest(request_id="reset")).success
    wait_until(lambda: again.look().status.state == TraversalStatus.IDLE)


THREE_LINES = """{"name": "three", "title": "Three lines", "line_width_m": 0.12, "segments": [
    {"id": "a", "line": {"start": [0, 0], "end": [9, 0]}, "actuation": "DISC_SPRAY"},
    {"id": "b", "line": {"start": [9, 4], "end": [0, 4]}, "actuation": "DISC_SPRAY"},
    {"id": "c", "line": {"start": [0, 8], "end": [9, 8]}, "actuation": "DISC_SPRAY"}]}"""


def test_a_killed_robot_goes_on_and_reports_the_whole_job(tmp_path: Path):
    recording = tmp_path / "session.mcap"
    with local_system(
        {"tt2": Setup(scenario=Scenario(noise="none"))}, options=ProcessOptions(recordings=tmp_path)
    ) as system:
        system.wait_until_ready(lambda doing: None)
        bus, observer = system.bus, Observer(system.bus)
        reports = bus.inbox([topics.REPORT])
        assert bus.call(topics.RECORD, RecordRequest(request_id="r", path=str(recording))).success
        plan = start_painting(bus, 20.0, THREE_LINES)
        wait_until(lambda: observer.look().status.coverage_pct > 45.0)
        before = bus.call(topics.GET_PAINT, GetPaintRequest()).strokes
        kill(system, topics.ROBOT_SIM)
        wait_until(lambda: observer.look().status.state == TraversalStatus.IDLE)
        load = LoadRequest(request_id="go on", trajectory=plan, template_json=THREE_LINES, resume=True)
        answer = bus.call(topics.LOAD, load, 60.0)
        assert "to go on at" in answer.message, answer.message
        restored = bus.call(topics.GET_PAINT, GetPaintRequest()).strokes
        assert restored[: len(before) - 1] == tuple(
            mark.model_copy(update={"header": restored[0].header}) for mark in before[:-1]
        )
        assert observer.look().status.coverage_pct > 45.0
        assert bus.call(topics.SET_SPEED, SetSpeedRequest(request_id="fast", factor=-1.0)).success
        assert bus.call(topics.START, CommandRequest(request_id="again")).success
        heard: list[Message] = []
        wait_until(lambda: bool(heard.extend(message for _, message in reports.messages()) or heard))
        report = heard[-1]
        assert isinstance(report, TraversalReport)
        strokes = bus.call(topics.GET_PAINT, GetPaintRequest()).strokes
        tank_l = observer.look().sprayer.tank_l
        bus.call(topics.RECORD_STOP, RecordStopRequest(request_id="s"))
    assert report.success
    assert report.coverage_pct >= 99.9
    assert 27.0 < report.painted_length_m < 27.2, "the joint is painted twice by less than 2 cm"
    assert 0.0 < report.double_paint_m2 < 0.02 * 0.12
    assert strokes[: len(restored) - 1] == tuple(
        mark.model_copy(update={"header": strokes[0].header}) for mark in restored[:-1]
    )
    assert len(strokes) > len(restored)
    used_l = report.painted_length_m * Vehicle().tool.paint_l_per_m
    assert tank_l == pytest.approx(Vehicle().tool.tank_l - used_l, abs=0.002)
    recorded = read_painted(recording).strokes
    assert [stroke.first_index for stroke in recorded] == [stroke.first_index for stroke in strokes]
    for here, there in zip(recorded, strokes, strict=True):
        assert np.array_equal(here.x_m, there.x_m) and np.array_equal(here.y_m, there.y_m), "nothing is missing"


def test_the_bridge_may_die_and_its_recording_can_be_read(painting):
    system, observer, recording = painting
    before_s = observer.look().status.header.stamp.sec

    def last_s(reader: RecordingReader) -> float:
        return max((message.log_time_ns / 1e9 for message in reader.messages()), default=0.0)

    wait_until(lambda: last_s(RecordingReader(recording)) > before_s)  # it does not keep to itself what it has heard
    kill(system, topics.BRIDGE)
    reader = RecordingReader(recording)
    assert last_s(reader) > before_s
    assert reader.summary.problem
    driven = observer.look().status.arc_length_m
    wait_until(lambda: observer.look().status.arc_length_m > driven + 5.0)


def test_the_robot_stops_by_itself_when_operator_and_planner_are_gone(bus_config: BusConfig, tmp_path: Path):
    robot = start_touchline("robot-sim", "--noise", "none", config=bus_config, log=tmp_path / "robot.log")
    planner = start_touchline("planner", config=bus_config, log=tmp_path / "planner.log")
    try:
        with Bus.open("bystander", bus_config) as bystander:
            observer = Observer(bystander)
            with Bus.open(topics.OPERATOR, bus_config) as operator:
                assert not operator.wait_for({topics.ROBOT_SIM, topics.PLANNER}, 60.0)
                start_painting(operator, 2.0)
                wait_until(lambda: observer.look().sprayer.valve_open)
                planner.kill()
                planner.wait()
                time.sleep(2.5)  # more than the time-out: the operator is still there
                assert observer.look().status.state == TraversalStatus.RUNNING
            wait_until(lambda: observer.look().status.state == TraversalStatus.PAUSED)
            wait_until(lambda: not observer.look().sprayer.valve_open and abs(observer.status.speed_mps) < 0.05)
            assert "link" in observer.status.reason or "operator" in observer.status.reason
    finally:
        for process in (robot, planner):
            process.terminate()
            process.wait()


def test_up_status_and_down(bus_config: BusConfig, tmp_path: Path):
    log = tmp_path / "up.log"
    up = start_touchline("up", config=bus_config, log=log)
    try:
        wait_until(lambda: "is up" in log.read_text())
        with Bus.open("bystander", bus_config) as bus:
            services = {topics.PLANNER, topics.ROBOT_SIM, topics.TELEMETRY, topics.BRIDGE}
            assert not bus.wait_for({*services, topics.SUPERVISOR}, 60.0)
            presence = bus.presence()
            wait_until(lambda: bool(presence.poll()))
            assert presence.alive() == {*services, topics.SUPERVISOR, "bystander"}, "nobody who minds the robot"
            assert bus.call(topics.diagnostics_service(topics.SUPERVISOR), GetDiagnosticsRequest()).diagnostics.status
        second = touchline("up", config=bus_config)
        assert second.returncode == 2
        assert "already running" in second.stderr
        another = touchline("robot-sim", config=bus_config)
        assert another.returncode == 2
        assert "already running" in another.stderr
        status = touchline("status", config=bus_config)
        assert status.returncode == 0, status.stdout
        assert "idle" in status.stdout
        assert "painted" not in status.stdout
        assert "stopped" in touchline("down", config=bus_config).stdout
        assert up.wait(100) == 0
        assert touchline("status", config=bus_config).returncode == 1
    finally:
        if up.poll() is None:
            up.kill()


def test_services_end_with_a_killed_supervisor(bus_config: BusConfig, tmp_path: Path):
    log = tmp_path / "up.log"
    up = start_touchline("up", config=bus_config, log=log)
    wait_until(lambda: "is up" in log.read_text())
    up.kill()
    up.wait()
    with Bus.open("bystander", bus_config) as bus:
        presence = bus.presence()
        wait_until(lambda: (presence.poll(), presence.alive())[1] == {"bystander"})


def test_ctrl_c_ends_a_run_in_order(tmp_path: Path, bus_config: BusConfig, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    recording, log = tmp_path / "run.mcap", tmp_path / "run.log"
    run = start_touchline("run", "soccer-11", "--speed", "5", "--record", str(recording), config=bus_config, log=log)
    wait_until(lambda: recording.exists() and recording.stat().st_size > 200_000)
    run.send_signal(signal.SIGINT)
    assert run.wait(60) == 130
    assert "Traceback" not in log.read_text()
    private = tmp_path / f"touchline-{os.getuid()}"
    assert {path.name for path in tmp_path.iterdir()} - {private.name} == {"run.mcap", "run.log"}
    assert not [path for path in private.glob("*") if path.stat().st_size]
    reader = RecordingReader(recording)
    assert sum(1 for _ in reader.messages()) > 1000
    assert not reader.summary.problem
