"""A standby takes over from a coordinator that is lost: nobody touches, and everybody goes on."""

from __future__ import annotations

import json
import subprocess
import time
import uuid
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.meeting import eventually
from tests.system.commands import start_touchline, touchline
from touchline.bus import Bus, BusConfig
from touchline.bus.health import STARTING
from touchline.bus.ports import free_port
from touchline.coordination.reported_contacts import tick_of
from touchline.schemas import topics
from touchline.schemas.fleet import Fleet
from touchline.schemas.messages import (
    DiagnosticArray,
    DiagnosticStatus,
    SetOwnerRequest,
    SetOwnerResponse,
    String,
    TeamStatus,
    TeamTaskRequest,
    TrueWay,
)
from touchline.schemas.team import TeamScenario

AREA = {"outline": [(0, 0), (5, 0), (5, 5), (0, 5)]}
STARTS = {"a": (0.6, 0.6), "b": (4.4, 0.6), "c": (2.5, 4.4)}
GOALS = {"a": [(4.4, 4.4)], "b": [(0.6, 4.4)], "c": [(2.5, 0.6)]}
BODIES_M = 0.354
TO_GOALS = {"kind": "goals", "goals": GOALS}
REQUESTS = [
    {"category": "go_to_place", "place": place, "dwell_s": 2.0}
    for place in ((4.4, 4.4), (0.6, 4.4), (2.5, 0.6), (4.4, 2.5), (0.6, 2.5), (2.5, 2.5))
]
DISPATCH = {"kind": "dispatch", "requests": REQUESTS}
ADDED = {"id": "added", "category": "delivery", "pickup": (1.0, 1.0), "dropoff": (4.0, 4.0), "pickup_s": 1.0}


def team(task: dict[str, Any], avoid: str) -> TeamScenario:
    places = {name: {"x_m": x, "y_m": y, "heading_rad": 0.0} for name, (x, y) in STARTS.items()}
    told = {"places": places, "area": AREA, "task": task, "avoid": avoid, "duration_s": 3000.0}
    return TeamScenario.model_validate(told)


class TrueWays:
    """True places of robots, by tick."""

    def __init__(self, bus: Bus) -> None:
        self._inboxes = {name: bus.of(name).inbox([topics.TRUE_WAY]) for name in STARTS}
        self._at: dict[str, dict[int, complex]] = {name: {} for name in STARTS}

    def look(self) -> None:
        for name, inbox in self._inboxes.items():
            for _, message in inbox.messages():
                assert isinstance(message, TrueWay)
                places = np.array(message.x_m) + 1j * np.array(message.y_m)
                first = tick_of(message) - len(places) + 1
                self._at[name] |= {first + number: place for number, place in enumerate(places.tolist())}

    @property
    def driven_m(self) -> float:
        """Distance of the robot that has come least far from its start."""
        return min(
            abs(next(reversed(each.values()), at := complex(*STARTS[name])) - at) for name, each in self._at.items()
        )

    @property
    def closest_m(self) -> float:
        """Least distance of two robots at the same tick."""
        common = sorted(set.intersection(*(set(each) for each in self._at.values())))
        places = np.array([[each[tick] for tick in common] for each in self._at.values()])
        one, other = np.triu_indices(len(places), 1)
        return float(np.abs(places[one] - places[other]).min())


class Done:
    """Tasks that have been completed, each once, with the times of that; and all that are known."""

    def __init__(self) -> None:
        self.at_s: dict[str, float] = {}
        self.known = set[str]()

    def look(self, queue: dict[str, Any]) -> None:
        now = {each["id"]: each["finished_s"] for each in queue["tasks"] if each["state"] == "completed"}
        assert self.at_s.items() <= now.items(), (self.at_s, now)
        self.at_s, self.known = now, {each["id"] for each in queue["tasks"]}


class System:
    """Three robots, their coordinator and a standby, each a process."""

    def __init__(self, stack: ExitStack, folder: Path, task: dict[str, Any], avoid: str) -> None:
        told = team(task, avoid)
        self._stack, self._folder, self.task = stack, folder, told.task
        self.config = BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}", namespaces=(topics.TEAM_NAMESPACE,))
        (folder / "team.json").write_text(told.model_dump_json())
        setups = {name: told.setup(name, told.places[name]) for name in told.names}
        (folder / "fleet.json").write_text(Fleet.of(setups).model_dump_json())
        self._coordinator = ("coordinator", "--team", str(folder / "team.json"), "--lockstep")
        self.robots = self.start("robots", "robot-sim", "--robots", str(folder / "fleet.json"), "--speed", "2")
        self.first = self.start("first", *self._coordinator)
        self.standby = self.another("standby")
        self.bus = stack.enter_context(Bus.open(topics.OPERATOR, self.config))
        self._inbox = self.bus.inbox([topics.TEAM_STATUS, topics.TEAM_QUEUE, topics.DIAGNOSTICS], keep="recent")
        self.done = Done()
        self.ways, self.status = TrueWays(self.bus), TeamStatus()
        self._doing, self._ready = "", set[str]()
        self._diagnostics = {name: self.bus.of(name).inbox([topics.DIAGNOSTICS]) for name in STARTS}

    def start(self, name: str, *arguments: str) -> subprocess.Popen[bytes]:
        process = start_touchline(*arguments, config=self.config, log=self._folder / f"{name}.log")
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        return process

    def said(self, name: str) -> str:
        return (self._folder / f"{name}.log").read_text()

    def another(self, name: str) -> subprocess.Popen[bytes]:
        return self.start(name, *self._coordinator, "--standby")

    def first_again(self) -> subprocess.CompletedProcess[str]:
        return touchline(*self._coordinator, config=self.config)

    def look(self) -> TeamStatus:
        self.ways.look()
        for _, message in self._inbox.messages():
            if isinstance(message, TeamStatus):
                self.status = message
            elif isinstance(message, String):
                self.done.look(json.loads(message.data))
            elif isinstance(message, DiagnosticArray) and message.status[0].name == topics.STANDBY:
                self._doing = message.status[0].message
        return self.status

    @property
    def ready(self) -> bool:
        """True once the standby stands by, and the robots have loaded their kernels."""
        self.look()
        for name, inbox in self._diagnostics.items():
            for _, message in inbox.messages():
                status = message.status[0] if isinstance(message, DiagnosticArray) else DiagnosticStatus()
                if status.name == topics.ROBOT_SIM and not status.message.startswith(STARTING):
                    self._ready.add(name)  # others send diagnostics of the robot, too
        return "stands by for session" in self._doing and self._ready == set(STARTS)

    def begin(self) -> bool:
        """True once all robots are guided; the coordinator may not know them yet."""
        request = TeamTaskRequest(request_id=uuid.uuid4().hex, task_json=self.task.model_dump_json())
        begun = self.bus.call(topics.TEAM_TASK, request, 120.0)
        time.sleep(0.0 if begun.success else 1.0)
        return begun.success

    def owner(self, bus: Bus, epoch: int) -> SetOwnerResponse:
        request = SetOwnerRequest(request_id=uuid.uuid4().hex, coordinator=bus.session_id, epoch=epoch)
        return bus.of("a").call(topics.SET_OWNER, request, 10.0)


@pytest.fixture
def system(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[System]:
    with ExitStack() as stack:
        yield System(stack, tmp_path, *request.param)


@pytest.mark.full
@pytest.mark.parametrize("system", [(TO_GOALS, "plans")], indirect=True, ids=[""])
def test_a_standby_goes_on_when_the_coordinator_is_killed_and_lets_nobody_back(system: System) -> None:
    assert eventually(lambda: system.ready, 120.0), system.said("standby")
    assert eventually(system.begin)
    assert eventually(lambda: bool(system.look()) and system.ways.driven_m > 1.0, 60.0)
    assert system.status.coordinator == ""
    system.first.kill()
    assert eventually(lambda: system.look().coordinator != "", 60.0), system.said("standby")
    assert system.status.arrived < len(STARTS)

    with Bus.open(topics.COORDINATOR, system.config) as other:
        newest = system.owner(other, 0).epoch
        old = system.owner(other, newest - 1)
        assert not old.success
        assert f"guides the robot in epoch {newest}: session {other.session_id} of epoch {newest - 1}" in old.message
    assert eventually(lambda: system.look().arrived == len(STARTS), 120.0), system.status
    assert system.ways.closest_m > BODIES_M

    again = system.first_again()
    assert again.returncode != 0
    assert "already running" in again.stderr


@pytest.mark.full
@pytest.mark.parametrize("system", [(DISPATCH, "plans"), (DISPATCH, "cells")], indirect=True, ids=["plans", "cells"])
def test_tasks_are_done_once_by_a_standby_and_by_a_coordinator_that_is_started_anew(system: System) -> None:
    assert eventually(lambda: system.ready, 120.0), system.said("standby")
    assert eventually(system.begin)
    assert eventually(lambda: bool(system.look()) and system.ways.driven_m > 1.0, 60.0)
    order = json.dumps({"add": [ADDED]})
    added = system.bus.call(topics.TEAM_REQUESTS, TeamTaskRequest(request_id="add", task_json=order), 30.0)
    assert added.success, added.message
    system.first.kill()
    assert eventually(lambda: system.look().coordinator != "", 60.0), system.said("standby")
    assert eventually(lambda: bool(system.look()) and len(system.done.at_s) >= 3, 120.0), system.done.at_s
    assert len(system.done.known) == len(REQUESTS) + 1
    system.standby.kill()
    successor = system.status.coordinator
    system.another("third")
    assert eventually(lambda: system.look().coordinator not in ("", successor), 120.0), system.said("third")
    assert eventually(lambda: bool(system.look()) and system.done.at_s.keys() == system.done.known, 180.0)
    assert len(system.done.known) == len(REQUESTS) + 1
    assert system.ways.closest_m > BODIES_M
