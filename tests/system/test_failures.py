"""Second copies and killed processes: every service still answers, nothing is lost, and no valve stays open."""

import os
import signal
import subprocess
import time
import uuid
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from tests.painted import read_painted
from tests.system.commands import start_touchline, touchline_here
from touchline.bus import Bus, BusConfig, CallError
from touchline.bus.ports import free_port
from touchline.recordings.reader import RecordingReader
from touchline.schemas import topics
from touchline.schemas.messages import (
    CommandRequest,
    Event,
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
from touchline.schemas.vehicles import Vehicle
from touchline.supervision.diagnostics import read_health

LONG_LINE = """{"name": "long", "title": "A line that takes longer than any test", "line_width_m": 0.12, "segments": [
    {"id": "a", "line": {"start": [0, 0], "end": [1000, 0]}, "actuation": "DISC_SPRAY"}]}"""
THREE_LINES = """{"name": "three", "title": "Three lines", "line_width_m": 0.12, "segments": [
    {"id": "a", "line": {"start": [0, 0], "end": [9, 0]}, "actuation": "DISC_SPRAY"},
    {"id": "b", "line": {"start": [9, 4], "end": [0, 4]}, "actuation": "DISC_SPRAY"},
    {"id": "c", "line": {"start": [0, 8], "end": [9, 8]}, "actuation": "DISC_SPRAY"}]}"""


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

    @property
    def time_s(self) -> float:
        """Sim time."""
        stamp = self.status.header.stamp
        return stamp.sec + 1e-9 * stamp.nanosec


def new_id() -> str:
    """A request with an id that was used before is answered, but not carried out again."""
    return uuid.uuid4().hex


def planned(bus: Bus, template: str) -> Trajectory:
    plan = bus.call(topics.PLAN_SERVICE, PlanRequest(request_id=new_id(), template_json=template), 200.0)
    assert plan.success, plan.message
    return plan.trajectory


def start_painting(bus: Bus, trajectory: Trajectory, speed: float, template: str) -> None:
    load = LoadRequest(request_id=new_id(), trajectory=trajectory, template_json=template)
    assert bus.call(topics.LOAD, load, 60.0).success
    assert bus.call(topics.SET_SPEED, SetSpeedRequest(request_id=new_id(), factor=speed)).success
    assert bus.call(topics.START, CommandRequest(request_id=new_id())).success


@dataclass
class Site:
    """The processes of ``touchline up``, and a bystander who kills some of them."""

    up: subprocess.Popen[bytes]
    folder: Path
    bus: Bus

    def __post_init__(self) -> None:
        self._events = self.bus.inbox([topics.SUPERVISOR_EVENTS])

    def pid(self, node: str) -> int | None:
        try:
            answer = self.bus.call(topics.diagnostics_service(node), GetDiagnosticsRequest(), 60.0)
        except CallError:
            return None
        return read_health(node, answer.diagnostics).pid

    def kill(self, node: str) -> list[Event]:
        """Kill a service; what the supervisor says of it until it answers again."""
        pid = self.pid(node)
        assert pid is not None
        os.kill(pid, signal.SIGKILL)
        told: list[Event] = []

        def restarted() -> bool:
            told.extend(message for _, message in self._events.messages() if isinstance(message, Event))
            return any(event.code == "restarted" for event in told)

        wait_until(restarted)
        wait_until(lambda: self.pid(node) not in (None, pid))
        return [event for event in told if event.text.startswith(f"{node} ")]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A system that the tests share: it survives all but the last."""
    folder, config = tmp_path_factory.mktemp("site"), BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}")
    log = folder / "up.log"
    up = start_touchline("up", "--noise", "none", "--recordings", str(folder), config=config, log=log)
    try:
        wait_until(lambda: "is up" in log.read_text())
        with Bus.open("bystander", config) as bus:
            yield Site(up, folder, bus)
    finally:
        up.terminate()
        up.wait()


@pytest.fixture(scope="module")
def painting(site: Site) -> Iterator[tuple[Bus, Observer, Path]]:
    """An operator whose robot paints a line at 3x and records, some paint already down; the robot is killed last."""
    recording = site.folder / "line.mcap"
    with Bus.open(topics.OPERATOR, site.bus.config) as bus:
        assert bus.call(topics.RECORD, RecordRequest(request_id=new_id(), path=str(recording))).success
        observer = Observer(bus)
        start_painting(bus, planned(bus, LONG_LINE), 3.0, LONG_LINE)
        wait_until(lambda: observer.look().sprayer.valve_open and observer.status.coverage_pct > 0.3)
        yield bus, observer, recording


def test_what_is_up_is_known_to_all_and_nothing_starts_twice(site: Site):
    services = {topics.PLANNER, topics.ROBOT_SIM, topics.TELEMETRY, topics.BRIDGE}
    assert not site.bus.wait_for({*services, topics.SUPERVISOR}, 60.0)
    presence = site.bus.presence()
    wait_until(lambda: bool(presence.poll()))
    assert presence.alive() == {*services, topics.SUPERVISOR, "bystander"}, "nobody who minds the robot"
    assert site.bus.call(topics.diagnostics_service(topics.SUPERVISOR), GetDiagnosticsRequest()).diagnostics.status
    for command in ("up", "robot-sim"):
        second = touchline_here(command, config=site.bus.config)
        assert second.returncode == 2
        assert "already running" in second.stderr
    status = touchline_here("status", config=site.bus.config)
    assert status.returncode == 0, status.stdout
    assert "idle" in status.stdout
    assert "painted" not in status.stdout


def test_a_killed_robot_comes_back_with_its_valve_closed_goes_on_and_reports_the_whole_job(site: Site):
    recording = site.folder / "whole job.mcap"
    with Bus.open(topics.OPERATOR, site.bus.config) as bus:
        observer, reports = Observer(bus), bus.inbox([topics.REPORT])
        assert bus.call(topics.RECORD, RecordRequest(request_id=new_id(), path=str(recording))).success
        plan = planned(bus, THREE_LINES)
        start_painting(bus, plan, 10.0, THREE_LINES)
        wait_until(lambda: observer.look().status.coverage_pct > 45.0 and observer.sprayer.valve_open)
        slowly = SetSpeedRequest(request_id=new_id(), factor=1.0)  # a busy machine may take long to kill it
        assert bus.call(topics.SET_SPEED, slowly).success
        before = bus.call(topics.GET_PAINT, GetPaintRequest(), 60.0).strokes
        site.kill(topics.ROBOT_SIM)
        again = Observer(bus)
        wait_until(lambda: again.look().status.state == TraversalStatus.IDLE)
        assert not again.sprayer.valve_open
        assert not bus.call(topics.START, CommandRequest(request_id=new_id())).success
        load = LoadRequest(request_id=new_id(), trajectory=plan, template_json=THREE_LINES, resume=True)
        answer = bus.call(topics.LOAD, load, 60.0)
        assert "to go on at" in answer.message, answer.message
        restored = bus.call(topics.GET_PAINT, GetPaintRequest(), 60.0).strokes
        assert restored[: len(before) - 1] == tuple(
            mark.model_copy(update={"header": restored[0].header}) for mark in before[:-1]
        )
        assert observer.look().status.coverage_pct > 45.0
        assert bus.call(topics.SET_SPEED, SetSpeedRequest(request_id=new_id(), factor=-1.0)).success
        assert bus.call(topics.START, CommandRequest(request_id=new_id())).success
        heard: list[Message] = []
        wait_until(lambda: bool(heard.extend(message for _, message in reports.messages()) or heard))
        report = heard[-1]
        assert isinstance(report, TraversalReport)
        strokes = bus.call(topics.GET_PAINT, GetPaintRequest(), 60.0).strokes
        tank_l = observer.look().sprayer.tank_l
        bus.call(topics.RECORD_STOP, RecordStopRequest(request_id=new_id()))
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


def test_the_bridge_may_die_and_its_recording_can_be_read(site: Site, painting):
    _, observer, recording = painting
    before_s = observer.look().time_s

    def last_s(reader: RecordingReader) -> float:
        return max((message.log_time_ns / 1e9 for message in reader.messages()), default=0.0)

    wait_until(lambda: last_s(RecordingReader(recording)) > before_s)  # it does not keep to itself what it has heard
    site.kill(topics.BRIDGE)
    reader = RecordingReader(recording)
    assert last_s(reader) > before_s
    assert reader.summary.problem
    driven = observer.look().status.arc_length_m
    wait_until(lambda: observer.look().status.arc_length_m > driven + 3.0)


def test_the_planner_may_die(site: Site, painting):
    bus, observer, _ = painting
    told = site.kill(topics.PLANNER)
    died, restarted = (event for event in told if event.code not in ("hangs", "turns"))  # a busy machine holds it up
    assert (died.code, restarted.code) == ("died", "restarted")
    assert "SIGKILL" in died.text
    before = observer.look().status.arc_length_m
    wait_until(lambda: observer.look().status.arc_length_m > before + 3.0)
    assert observer.status.state == TraversalStatus.RUNNING
    assert planned(bus, LONG_LINE).path.segments


def test_services_end_with_a_killed_supervisor(site: Site):
    presence = site.bus.presence()
    wait_until(lambda: (presence.poll(), presence.alive())[1] >= {*topics.SERVING, topics.TELEMETRY})
    site.up.kill()
    site.up.wait()
    wait_until(lambda: (presence.poll(), presence.alive())[1] <= {"bystander", topics.OPERATOR})
    assert touchline_here("status", config=site.bus.config).returncode == 1


def test_ctrl_c_ends_a_run_in_order(tmp_path: Path, bus_config: BusConfig, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    recording, log, field = tmp_path / "run.mcap", tmp_path / "run.log", tmp_path / "field.json"
    field.write_text(LONG_LINE)
    run = start_touchline("run", str(field), "--speed", "5", "--record", str(recording), config=bus_config, log=log)
    wait_until(lambda: recording.exists() and recording.stat().st_size > 200_000)
    run.send_signal(signal.SIGINT)
    assert run.wait(60) == 130
    assert "Traceback" not in log.read_text()
    private = tmp_path / f"touchline-{os.getuid()}"
    assert {path.name for path in tmp_path.iterdir()} - {private.name} == {recording.name, log.name, field.name}
    assert not [path for path in private.glob("*") if path.stat().st_size]
    reader = RecordingReader(recording)
    assert sum(1 for _ in reader.messages()) > 1000
    assert not reader.summary.problem
