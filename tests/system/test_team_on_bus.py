"""A team over Zenoh: the bytes of `fleet simulate` in one process or in several; robots that come, and what dies."""

from __future__ import annotations

import json
import subprocess
import sys
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.meeting import eventually
from tests.system.commands import figures, start_touchline, touchline, touchline_here
from touchline.bus import Bus, BusConfig
from touchline.bus.ports import free_port
from touchline.checking.check_session import check_recording
from touchline.jobs.team.recorded_team import read_team
from touchline.recordings.channels import robots_among
from touchline.recordings.reader import RecordingReader
from touchline.schemas import topics
from touchline.schemas.errors import SpecError
from touchline.schemas.fleet import Fleet
from touchline.schemas.messages import (
    CommandRequest,
    Odometry,
    TeamCells,
    TeamReport,
    TeamRobotRequest,
    TeamRobotResponse,
    TeamStatus,
    TeamTaskRequest,
)
from touchline.schemas.scenario import Pose2
from touchline.schemas.team import TeamScenario
from touchline.services.coordinator.service import run_service

RUN = ("--robots", "2", "--duration", "4", "--seed", "5", "--json")


@pytest.mark.full
def test_over_the_bus_a_process_for_each_robot_has_the_bytes_of_the_simulation(tmp_path: Path) -> None:
    """One process for all has them, too: below."""
    recording, one = tmp_path / "team.mcap", tmp_path / "simulated.mcap"
    simulated = figures(touchline_here("fleet", "simulate", *RUN, "--hash", "--record", str(one)))["hash"]["robots"]
    done = figures(touchline("fleet", "run", *RUN, "--processes", "--record", str(recording)))
    assert done["success"], done["reason"]
    assert done["hash"]["robots"] == simulated
    assert done["bus"]["lost"] == done["recording"]["lost"] == 0
    reader = RecordingReader(recording)
    names = set(robots_among(message.topic for message in reader.messages()))
    assert names == {"tb1", "tb2", topics.TEAM_NAMESPACE}
    alike = touchline_here("compare", str(one), str(recording))
    assert alike.returncode == 0, alike.stdout
    assert [each.passed for each in check_recording(one)] == [True, True]


def test_robots_that_touch_have_their_bumpers_pressed_at_the_same_tick_over_the_bus(tmp_path: Path) -> None:
    close, slips = {"a": at(1.0), "b": at(1.36), "c": at(3.0)}, [{"kind": "wheel-slip", "wheel": "left", "share": -0.5}]
    goals = {"kind": "goals", "goals": {"a": [(3.0, 1.0)], "b": [(0.5, 1.0)], "c": [(1.0, 3.0)]}}
    file, recording = tmp_path / "team.json", tmp_path / "team.mcap"
    told = {"places": close, "area": AREA, "task": goals, "faults": {"b": slips}, "duration_s": 4.0}
    file.write_text(json.dumps(told))
    run = ("--team", str(file), "--json")
    simulated = touchline_here("fleet", "simulate", *run, "--hash", "--record", str(recording))
    driven = touchline("fleet", "run", *run)
    assert (simulated.returncode, driven.returncode) == (1, 1)
    one, other = json.loads(simulated.stdout), json.loads(driven.stdout)
    assert one["contacts"] == other["contacts"] == 1
    assert one["stopped"] == dict.fromkeys("ab", "the bumper is pressed")
    assert one["closest_m"] == other["closest_m"] < 0.354
    assert one["hash"] == other["hash"]
    assert len(read_team(recording).contacts().pairs) == 1


@pytest.mark.full
@pytest.mark.parametrize("avoid", ["cells", "plans"])
def test_an_algorithm_decides_the_same_over_the_bus(avoid: str, tmp_path: Path) -> None:
    pursuit = Path(__file__).parents[2] / "examples" / "teams" / "cyclic_pursuit.py"
    recording, algorithm = tmp_path / "team.mcap", ("--algorithm", f"{pursuit}:CyclicPursuit", "--avoid", avoid)
    run = ("--robots", "3", "--duration", "4", *algorithm, "--json")
    one = figures(touchline_here("fleet", "simulate", *run, "--hash"))
    other = figures(touchline("fleet", "run", *run, "--record", str(recording)))
    assert [each.passed for each in check_recording(recording)] == [True, True, True]
    assert one["hash"] == other["hash"]
    assert one["algorithm"] == other["algorithm"]
    assert one["intervention"] == other["intervention"]
    assert one["algorithm"]["radio"]["delivered"] > 0


def test_an_algorithm_that_cannot_be_made_is_refused_before_anything_is_started(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text("class Mine:\n    def __init__(self, gain): pass\n    def decide(self, now): return {}\n")
    refused = touchline_here("fleet", "run", "--algorithm", f"{file}:Mine")
    assert refused.returncode == 2
    assert "cannot be made" in refused.stderr
    told = TeamScenario.model_validate({"algorithm": {"use": "nobody"}})
    with pytest.raises(SpecError, match="is 'nobody'"):
        run_service(told)


def test_a_process_of_another_decides_over_zenoh(bus_config: BusConfig, tmp_path: Path) -> None:
    script = Path(__file__).parents[2] / "examples" / "teams" / "over_zenoh.py"
    places = {name: {"x_m": x, "y_m": 2.0, "heading_rad": 0.0} for name, x in (("a", 1.0), ("b", 2.2), ("c", 3.4))}
    file = tmp_path / "team.json"
    file.write_text(json.dumps({"places": places, "area": AREA, "duration_s": 8.0, "algorithm": {"use": "external"}}))
    with subprocess.Popen([sys.executable, str(script), bus_config.endpoint, *places]) as other:
        try:
            run = figures(touchline("fleet", "run", "--team", str(file), "--json", config=bus_config))
        finally:
            other.terminate()
    assert run["success"], run["reason"]
    radio = run["algorithm"]["radio"]
    assert radio["sent"] > 0.8 * 3 * radio["rounds"]
    assert radio["delivered"] > 0
    assert not run["algorithm"]["held"]
    assert run["closest_m"] < 0.6  # they have met


def at(x_m: float) -> dict[str, float]:
    return {"x_m": x_m, "y_m": 1.0, "heading_rad": 0.0 if x_m < 1.2 else 3.14159}


SPEED = "8"
PLACES = {"a": (1.0, 1.0), "b": (2.0, 1.0), "c": (3.0, 1.0), "late": (2.0, 3.5)}
AREA = {"outline": [(0, 0), (4, 0), (4, 4), (0, 4)]}
CORNERS = {"kind": "goals", "goals": {"a": [(3.4, 0.6)], "b": [(3.4, 3.4)], "c": [(0.6, 0.6)]}}
OTHERS = {"kind": "goals", "goals": {"a": [(3.4, 3.4)], "b": [(0.6, 0.6)], "c": [(3.4, 0.6)]}}


def team(*names: str) -> TeamScenario:
    places = {name: {"x_m": x, "y_m": y, "heading_rad": 0.0} for name, (x, y) in PLACES.items() if name in names}
    return TeamScenario.model_validate({"places": places, "area": AREA})


@contextmanager
def robots(config: BusConfig, folder: Path, *names: str) -> Iterator[None]:
    """A process of these robots, at 8 times real time."""
    told = team(*names)
    starts = {name: Pose2(x_m=x, y_m=y, heading_rad=0.0) for name, (x, y) in PLACES.items() if name in names}
    setups = {name: told.setup(name, start) for name, start in starts.items()}
    file = folder / f"{names[0]}.json"
    file.write_text(Fleet.of(setups).model_dump_json())
    process = start_touchline(
        "robot-sim", "--robots", str(file), "--speed", SPEED, config=config, log=folder / f"{names[0]}.log"
    )
    try:
        yield
    finally:
        process.kill()
        process.wait()


def truths(bus: Bus, *names: str) -> Callable[[], dict[str, tuple[float, float, float]]]:
    """True places of robots, and their speeds."""
    inboxes = {name: bus.of(name).inbox([topics.TRUTH], keep="latest") for name in names}
    newest: dict[str, tuple[float, float, float]] = {}

    def look() -> dict[str, tuple[float, float, float]]:
        for name, inbox in inboxes.items():
            for _, message in inbox.messages():
                assert isinstance(message, Odometry)
                at = message.pose.pose.position
                newest[name] = (at.x, at.y, message.twist.twist.linear.x)
        return newest

    return look


def guided(bus: Bus, task: object) -> bool:
    """Return whether the coordinator has taken a task."""
    request = TeamTaskRequest(request_id=str(uuid.uuid4()), task_json=json.dumps(task))
    return bus.call(topics.TEAM_TASK, request, 120.0).success


def test_a_team_on_the_bus_takes_in_who_comes_and_stands_when_nobody_guides_it(tmp_path: Path) -> None:
    config = BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}", namespaces=(topics.TEAM_NAMESPACE,))
    file = tmp_path / "team.json"
    file.write_text(team("a", "b", "c").model_dump_json())
    with robots(config, tmp_path, "a", "b", "c"), Bus.open(topics.OPERATOR, config) as bus:
        coordinator = start_touchline(
            "coordinator", "--team", str(file), config=config, log=tmp_path / "coordinator.log"
        )
        try:
            setup = bus.inbox([topics.TEAM_SETUP], keep="latest")
            assert eventually(lambda: bool(setup.drain())), (tmp_path / "coordinator.log").read_text()
            for name in ("a", "b", "c"):
                assert not bus.of(name).wait_for({topics.ROBOT_SIM}, 60.0)
            status = Newest(bus)
            look = truths(bus, "a", "b", "c", "late")
            refused = bus.call(topics.TEAM_TASK, TeamTaskRequest(request_id="0", task_json='{"kind": "dance"}'))
            assert not refused.success
            # Robots that still load their kernels do not answer their coordinator in time: it is asked again.
            assert eventually(lambda: guided(bus, CORNERS), 300.0)
            assert eventually(lambda: status.now.arrived == 3, 200.0), status.now
            assert eventually(lambda: status.report.finished), status.report
            assert (status.report.robots, status.report.missing) == (("a", "b", "c"), ())
            with robots(config, tmp_path, "late"):
                assert eventually(lambda: len(status.cells.cells) == 4 and status.now.resting == 0), status.now
                deploy = TeamTaskRequest(request_id="2", task_json='{"kind": "deploy"}')
                assert bus.call(topics.TEAM_TASK, deploy, 60.0).success
                assert status.report.task == "goals"
                paused = bus.call(topics.TEAM_STOP, CommandRequest(request_id="3"), 30.0)
                assert paused.success, paused.message
            assert "may drive" in remove(bus, "a").message
            assert eventually(lambda: remove(bus, "late").success), remove(bus, "late").message
            assert eventually(lambda: [cell.name for cell in status.cells.cells] == ["a", "b", "c"])
            admitted = bus.call(topics.TEAM_ADMIT, TeamRobotRequest(request_id="admit", robot="late"), 30.0)
            assert admitted.success, admitted.message
            others = TeamTaskRequest(request_id="4", task_json=json.dumps(OTHERS))
            assert bus.call(topics.TEAM_TASK, others, 60.0).success
            assert eventually(lambda: status.report.task == "deploy"), status.report
            assert not status.report.finished
            for name in ("a", "b", "c"):
                assert bus.of(name).call(topics.RESUME, CommandRequest(request_id="5")).success
            assert eventually(lambda: any(abs(v) > 0.3 for _, _, v in look().values())), look()
            coordinator.kill()
            assert eventually(lambda: all(abs(v) < 0.01 for name, (_, _, v) in look().items() if name != "late"), 30.0)
        finally:
            coordinator.kill()
            coordinator.wait()


def remove(bus: Bus, name: str) -> TeamRobotResponse:
    request = TeamRobotRequest(request_id=uuid.uuid4().hex, robot=name)
    return bus.call(topics.TEAM_REMOVE, request, 30.0)


class Newest:
    """Last message of the coordinator."""

    def __init__(self, bus: Bus) -> None:
        self._inbox = bus.inbox([topics.TEAM_STATUS, topics.TEAM_CELLS, topics.TEAM_REPORT], keep="latest")
        self._told: dict[type, Any] = {kind: kind() for kind in (TeamStatus, TeamCells, TeamReport)}

    def _last(self, kind: type) -> Any:
        self._told |= {type(message): message for _, message in self._inbox.messages()}
        return self._told[kind]

    @property
    def now(self) -> TeamStatus:
        return self._last(TeamStatus)

    @property
    def cells(self) -> TeamCells:
        return self._last(TeamCells)

    @property
    def report(self) -> TeamReport:
        return self._last(TeamReport)
