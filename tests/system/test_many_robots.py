"""Three robots on one bus, in one process and in three: driven, recorded, replayed, listed, each the same as alone."""

import os
import signal
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from tests.meeting import eventually
from tests.painted import read_painted
from tests.system.commands import figures, start_touchline, touchline_here
from touchline.bus import Bus, BusConfig
from touchline.bus.ports import free_port
from touchline.jobs.single.simulation import Job, Products, simulate
from touchline.recordings.channels import is_drawn, namespace_at, topic_at
from touchline.recordings.compare import compare
from touchline.recordings.reader import RecordingReader
from touchline.recordings.recording_file import RecordingError
from touchline.schemas import topics
from touchline.schemas.bus_variables import NAMESPACE_VARIABLE
from touchline.schemas.catalogue import parse_template
from touchline.schemas.errors import SpecError
from touchline.schemas.fleet import Fleet
from touchline.schemas.messages import (
    CommandRequest,
    LoadRequest,
    PlanOptions,
    PlanRequest,
    RecordRequest,
    RecordStopRequest,
    TraversalReport,
)
from touchline.schemas.setup import Setup
from touchline.services.bridge.replay_service import Playback, run_replay
from touchline.services.robot_sim.guards import RESET_AFTER_S

TEMPLATE = """{"name": "two-lines", "segments": [
    {"id": "a", "line": {"start": [0, 0], "end": [1, 0]}}, {"id": "b", "line": {"start": [1, 1], "end": [0, 1]}}]}"""
FLEET = """{"robots": [
    {"namespace": "r1", "seed": 11},
    {"namespace": "club/r2", "seed": 12, "vehicle": "narrow.json", "onboard": {"follower": "pure-pursuit"}},
    {"namespace": "r3", "seed": 13, "onboard": {"follower": "pure-pursuit"},
     "vehicle": {"name": "wide", "drive": {"kind": "differential", "track_width_m": 0.6}}}
]}"""
ROBOTS = ("r1", "club/r2", "r3")
PACE = 8.0


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three robots of different seeds and vehicles."""
    folder = tmp_path_factory.mktemp("fleet")
    (folder / "narrow.json").write_text('{"name": "narrow", "drive": {"kind": "differential", "track_width_m": 0.45}}')
    (folder / "robots.json").write_text(FLEET)
    (folder / "template.json").write_text(TEMPLATE)
    return folder / "robots.json"


@contextmanager
def system(fleet: Path, config: BusConfig, folder: Path, *options: str) -> Iterator[None]:
    """``touchline up`` with the fleet, until ``touchline down``."""
    log = folder / "up.log"
    up = start_touchline("up", "--robots", str(fleet), "--recordings", str(folder), *options, config=config, log=log)
    try:
        assert eventually(lambda: "is up" in log.read_text(), 300.0), log.read_text()
        yield
    finally:
        assert touchline_here("down", config=unnamed(config)).stdout == f"stopped (pid {up.pid})\n"
        assert up.wait(60) == 0


class Driven(NamedTuple):
    """A robot's report of its job, and its pace against the wall clock."""

    session_hash: str
    pace: float


def drive(buses: dict[str, Bus], setups: dict[str, Setup], recording: Path) -> dict[str, Driven]:
    """Have every robot paint the template at once, recorded."""
    first = next(iter(buses.values()))
    begun = first.call(topics.RECORD, RecordRequest(request_id="record", path=str(recording)), 60.0)
    assert begun.success, begun.message
    inboxes = {name: bus.inbox([topics.REPORT]) for name, bus in buses.items()}
    for name, bus in buses.items():
        vehicle = setups[name].vehicle.model_dump_json()
        request = PlanRequest(request_id=f"plan {name}", template_json=TEMPLATE, vehicle_json=vehicle)
        planned = bus.call(topics.PLAN_SERVICE, request, 300.0)
        assert planned.success, planned.message
        load = LoadRequest(request_id=f"load {name}", trajectory=planned.trajectory, template_json=TEMPLATE)
        loaded = bus.call(topics.LOAD, load, 60.0)
        assert loaded.success, loaded.message
    begun_s = time.monotonic()
    for name, bus in buses.items():
        assert bus.call(topics.START, CommandRequest(request_id=f"start {name}"), 60.0).success
    driven: dict[str, Driven] = {}

    def done() -> bool:
        for name, inbox in inboxes.items():
            for _, message in inbox.messages():
                if isinstance(message, TraversalReport):
                    pace = message.total_time_s / (time.monotonic() - begun_s)
                    driven[name] = Driven(message.session_hash, pace)
        return len(driven) == len(buses)

    assert eventually(done, 300.0)
    ended = first.call(topics.RECORD_STOP, RecordStopRequest(request_id="stop"), 60.0)
    assert ended.success, ended.message
    assert ended.lost == 0
    return driven


def contents(recording: Path) -> dict[str, dict[str, list[bytes]]]:
    """Payloads of the recorded topics by robot and topic, but for those that are made for viewers."""
    found: dict[str, dict[str, list[bytes]]] = defaultdict(lambda: defaultdict(list))
    for message in RecordingReader(recording).messages():
        topic = topic_at(message.topic)
        if topic is None:
            assert is_drawn(message.topic, ROBOTS)
            continue
        found[namespace_at(message.topic)][topic.name].append(message.payload)
    return found


@contextmanager
def operators(config: BusConfig) -> Iterator[dict[str, Bus]]:
    with Bus.open_all(topics.OPERATOR, config.of(*ROBOTS)) as buses:
        for bus in buses:
            assert not bus.wait_for({*topics.SERVING, topics.TELEMETRY}, 60.0)
        yield {bus.namespace: bus for bus in buses}


class Session(NamedTuple):
    """Results of the three jobs: the recording, the reports, and the output of commands meanwhile."""

    recording: Path
    driven: dict[str, Driven]
    status: dict[str, Any]


class Ordered(NamedTuple):
    """Output of commands that were given one after the other while the robots were there."""

    refused: str
    done: dict[str, Any]
    absent: str
    stopped: str
    reset: str
    states: dict[str, str]


@pytest.fixture(scope="module")
def together_then_ordered(fleet: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Session, Ordered]:
    """All robots in one process, as fast as they go; it is there no longer than needed."""
    folder, config = tmp_path_factory.mktemp("together"), BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}")
    with system(fleet, config, folder, "--speed", "max"):
        return session(fleet, config, folder), ordered(folder, unnamed(config))


@pytest.fixture(scope="module")
def together(together_then_ordered: tuple[Session, Ordered]) -> Session:
    """Results of them in one process."""
    return together_then_ordered[0]


@pytest.fixture(scope="module")
def apart(fleet: Path, tmp_path_factory: pytest.TempPathFactory) -> Session:
    """Each robot in a process of its own, at a pace."""
    folder, config = tmp_path_factory.mktemp("apart"), BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}")
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("XDG_STATE_HOME", str(folder))  # the others of the same names keep their journals elsewhere
        with system(fleet, config, folder, "--apart", "--speed", str(PACE)):
            done = session(fleet, config, folder)
            kill_second(done.status, folder / "up.log")
    said = (folder / "up.log").read_text()
    assert "robot-sim of club/r2 was ended by SIGKILL" in said
    assert "robot-sim of r1" not in said and "robot-sim of r3" not in said, "the others are left alone"
    return done


def kill_second(status: dict[str, Any], log: Path) -> None:
    """Kill the process of one robot, and wait until the supervisor has another."""
    robot = next(robot for robot in status["robots"] if robot["namespace"] == "club/r2")
    (pid,) = (service["pid"] for service in robot["services"] if service["node"] == topics.ROBOT_SIM)
    os.kill(pid, signal.SIGKILL)
    assert eventually(lambda: "robot-sim of club/r2 restarted" in log.read_text())


def session(fleet: Path, config: BusConfig, folder: Path) -> Session:
    with operators(config) as buses:
        status = figures(touchline_here("status", "--json", config=unnamed(config)))
        driven = drive(buses, Fleet.read(fleet).setups(), folder / "session.mcap")
    return Session(folder / "session.mcap", driven, status)


def test_each_robot_says_in_one_process_what_it_says_alone(fleet, together):
    for robot, setup in Fleet.read(fleet).setups().items():
        job = Job.prepare(parse_template(TEMPLATE), PlanOptions(), setup.vehicle)
        alone = simulate(job, setup.scenario, setup.onboard, Products(hashed=True)).report.session_hash
        assert alone == together.driven[robot].session_hash
    assert len({driven.session_hash for driven in together.driven.values()}) == 3


@pytest.mark.full
def test_each_robot_says_in_a_process_of_its_own_at_another_pace_what_it_says_in_one_of_all(together, apart):
    ours, theirs = contents(together.recording), contents(apart.recording)
    assert set(ours) == set(theirs) == set(ROBOTS)
    for robot in ROBOTS:
        for topic in topics.RECORDED:
            assert ours[robot][topic.name] == theirs[robot][topic.name], (robot, topic.name)
        assert together.driven[robot].session_hash == apart.driven[robot].session_hash
        assert 1.0 < apart.driven[robot].pace <= PACE, "lags of a busy machine are not caught up with"
    assert len({tuple(ours[robot]["plan"]) for robot in ROBOTS}) == 3, "each is planned for its own vehicle"
    assert_listed(apart.status, processes=3)
    result = compare(together.recording, apart.recording)
    assert result.identical, list(result.lines())
    assert {namespace_at(path) for path in result.topics} == set(ROBOTS)


def test_status_lists_all_robots_and_the_processes_that_they_share(together):
    assert_listed(together.status, processes=1)


def assert_listed(status: dict[str, Any], processes: int) -> None:
    robots = status["robots"]
    assert [robot["namespace"] for robot in robots] == sorted(ROBOTS)
    pids = {service["node"]: set() for service in robots[0]["services"]}
    for robot in robots:
        assert robot["traversal"]["state"] == "idle"
        for service in robot["services"]:
            pids[service["node"]].add(service["pid"])
    assert {node: len(of_node) for node, of_node in pids.items()} == {
        topics.PLANNER: 1,
        topics.ROBOT_SIM: processes,
        topics.BRIDGE: 1,
    }


@pytest.mark.parametrize("chosen", [(), ("club/r2", "r1")])
def test_a_recording_of_three_is_replayed_as_three_or_as_those_that_are_named(together, bus_config, chosen):
    shared, robots = together, chosen or ROBOTS
    with Bus.open_all(topics.OPERATOR, bus_config.of(*ROBOTS)) as buses:
        inboxes = [bus.inbox(topics.RECORDED) for bus in buses]
        report = run_replay(shared.recording, Playback(0.0, chosen), bus_config)
        heard: dict[str, dict[str, list[bytes]]] = defaultdict(lambda: defaultdict(list))

        def all_heard() -> bool:
            for inbox in inboxes:
                for sample in inbox.drain():
                    heard[sample.namespace][sample.topic.name].append(sample.payload)
            return sum(len(said) for of_robot in heard.values() for said in of_robot.values()) >= report.sent

        assert eventually(all_heard)
    recorded = contents(shared.recording)
    assert heard == {robot: recorded[robot] for robot in robots}
    assert report.skipped == 0


def test_a_robot_that_was_not_recorded_cannot_be_replayed(together, bus_config):
    with pytest.raises(RecordingError, match="has no robot r4, but r1, club/r2, r3"):
        run_replay(together.recording, Playback(0.0, ["r4"]), bus_config)


def test_the_paint_of_one_of_them_is_drawn(together, tmp_path):
    with pytest.raises(SpecError, match="no template of robot r4"):
        read_painted(together.recording, "r4")
    painted = [read_painted(together.recording, robot) for robot in ROBOTS]
    assert len({painted_by.report.session_hash for painted_by in painted}) == 3


def ordered(folder: Path, config: BusConfig) -> Ordered:
    """Have one robot do a job, stop all, and reset one."""
    elsewhere = str(folder.with_name("elsewhere.mcap"))
    refused = touchline_here("record", elsewhere, "--seconds", "0.1", config=config)
    done = touchline_here("run", "study-square", "--robot", "r3", "--json", config=config)
    absent = touchline_here("order", "start", config=config)
    stopped = touchline_here("order", "estop", config=config)
    time.sleep(RESET_AFTER_S)
    reset = touchline_here("order", "reset", "--robot", "r1", config=config)
    status = figures(touchline_here("status", "--json", config=config))["robots"]
    states = {robot["namespace"]: robot["traversal"]["state"] for robot in status}
    return Ordered(refused.stderr, figures(done), absent.stderr, stopped.stdout, reset.stdout, states)


def test_a_run_drives_the_robot_that_is_named_and_an_emergency_stop_reaches_all(together_then_ordered):
    _, said = together_then_ordered
    assert "is outside of the recordings folder" in said.refused, "a bridge answers, though none is named"
    assert (said.done["success"], said.done["seed"], said.done["vehicle"]) == (True, 13, "wide")
    assert "there is no robot tt2 on the bus, but club/r2, r1, r3" in said.absent
    assert sorted(said.stopped.splitlines()) == sorted(f"{robot}: estop: done" for robot in ROBOTS)
    assert said.reset == "reset: done\n"
    assert said.states == {"r1": "idle", "club/r2": "estopped", "r3": "estopped"}


def unnamed(config: BusConfig) -> BusConfig:
    """The bus, for a command that is not told of any robot."""

    class _Unnamed(BusConfig):
        def environment(self) -> dict[str, str]:
            return {name: value for name, value in super().environment().items() if name != NAMESPACE_VARIABLE}

    return _Unnamed(endpoint=config.endpoint)
