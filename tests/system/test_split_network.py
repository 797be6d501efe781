"""A team on both sides of a network that is split and joined again: nobody touches, and everybody goes on."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import pytest

from tests.meeting import eventually
from tests.system.namespaces import Namespaces
from touchline.bus import BusConfig
from touchline.schemas.bus_variables import OPEN_VARIABLE
from touchline.schemas.fleet import Fleet
from touchline.schemas.team import TeamScenario

AREA = {"outline": [(0, 0), (5, 0), (5, 5), (0, 5)]}
STARTS = {"a": (0.6, 0.6), "b": (4.4, 0.6), "c": (2.5, 4.4)}
#: Each crosses the others' ways again and again.
GOALS = {
    "a": [(4.4, 4.4), (0.6, 2.5), (4.4, 0.6), (0.6, 4.4), (0.6, 0.6), (4.4, 4.4)],
    "b": [(0.6, 4.4), (4.4, 2.5), (0.6, 0.6), (4.4, 4.4), (4.4, 0.6), (0.6, 4.4)],
    "c": [(2.5, 0.6), (2.5, 4.4), (1.0, 1.0), (4.0, 4.0), (0.6, 2.5), (2.5, 0.6)],
}
BODIES_M = 0.354
SPLIT_S = 10.0
LEFT, RIGHT = "left", "right"
ADDRESSES = {LEFT: "10.9.1.1", RIGHT: "10.9.1.2"}
PORT = 7461


def team(task: dict[str, Any]) -> TeamScenario:
    places = {name: {"x_m": x, "y_m": y, "heading_rad": 0.0} for name, (x, y) in STARTS.items()}
    told = {"places": places, "area": AREA, "task": task, "avoid": "plans", "duration_s": 3000.0}
    return TeamScenario.model_validate(told)


class Heard:
    """Notes of the observers of both sides."""

    def __init__(self, files: list[Path]) -> None:
        self._files, self._read = files, dict.fromkeys(files, 0)
        self.ways: dict[str, dict[int, complex]] = {name: {} for name in STARTS}
        self.ready = set[str]()
        self.standby = self.coordinator = ""
        self.arrived = 0

    def look(self) -> Heard:
        for file in self._files:
            text = file.read_text()[self._read[file] :] if file.is_file() else ""
            whole = text[: text.rfind("\n") + 1]
            self._read[file] += len(whole)
            for line in whole.splitlines():
                self._note(json.loads(line))
        return self

    def _note(self, line: dict[str, Any]) -> None:
        if "way" in line:
            first = line["tick"] - len(line["x"]) + 1
            places = enumerate(map(complex, line["x"], line["y"]), first)
            self.ways[line["way"]] |= dict(places)
        self.ready |= {line["ready"]} if "ready" in line else set()
        self.standby = line.get("standby", self.standby)
        self.arrived, self.coordinator = line.get("arrived", self.arrived), line.get("coordinator", self.coordinator)

    def driven_m(self, name: str) -> float:
        places = list(self.ways[name].values())
        return sum(abs(after - before) for before, after in pairwise(places))

    @property
    def least_driven_m(self) -> float:
        return min(map(self.driven_m, STARTS))

    @property
    def closest_m(self) -> float:
        """Least distance of two robots at the same tick."""
        pairs = combinations(self.ways.values(), 2)
        return min(abs(one[tick] - other[tick]) for one, other in pairs for tick in one.keys() & other.keys())


class SplitNetwork:
    """Two machines with a router each, and a cable between."""

    def __init__(self, stack: ExitStack, folder: Path, task: dict[str, Any]) -> None:
        self._stack, self.folder, self.team = stack, folder, team(task)
        self._spaces = Namespaces(stack, ADDRESSES)
        self._spaces.ip(LEFT, f"link add eth0 type veth peer name eth0 netns {self._spaces.holders[RIGHT]}")
        for side, address in ADDRESSES.items():
            self._spaces.ip(side, "link set lo up", f"addr add {address}/24 dev eth0", "link set eth0 up")
        (folder / "client.json5").write_text('{mode: "client"}')
        (folder / "team.json").write_text(self.team.model_dump_json())
        for side in ADDRESSES:
            self._start_router(side)
        files = [folder / f"{side}.heard" for side in ADDRESSES]
        self.heard = Heard(files)
        for side, file in zip(ADDRESSES, files, strict=True):
            self._start(side, f"observer-{side}", "-m", "tests.system.team_observer", str(file), *STARTS)

    def _start_router(self, side: str) -> None:
        file = self.folder / f"router-{side}.json5"
        listen = [f"tcp/0.0.0.0:{PORT}"]
        connect = [f"tcp/{ADDRESSES[LEFT]}:{PORT}"] if side == RIGHT else []
        file.write_text(json.dumps({"listen": {"endpoints": listen}, "connect": {"endpoints": connect}}))
        self._start(side, f"router-{side}", "-m", "touchline", "router", settings=file)

    def _start(self, side: str, name: str, *command: str, settings: Path | None = None) -> subprocess.Popen[bytes]:
        config = BusConfig(f"tcp/127.0.0.1:{PORT}", config_file=settings or self.folder / "client.json5")
        with (self.folder / f"{name}.log").open("wb") as output:
            process = subprocess.Popen(
                [*self._spaces.on(side), sys.executable, *command],
                env={
                    **os.environ,
                    **config.environment(),
                    OPEN_VARIABLE: "1",
                    "XDG_STATE_HOME": str(self.folder / side),
                },
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
            )
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        return process

    def robots(self, side: str, *names: str) -> None:
        """Start a process of robots at twice real time."""
        file = self.folder / f"robots-{side}.json"
        setups = {name: self.team.setup(name, self.team.places[name]) for name in names}
        file.write_text(Fleet.of(setups).model_dump_json())
        command = ("robot-sim", "--robots", str(file), "--speed", "2", "--journal", str(self.folder))
        self._start(side, f"robots-{side}", "-m", "touchline", *command)

    def coordinator(self, side: str, *more: str) -> subprocess.Popen[bytes]:
        command = ("coordinator", "--team", str(self.folder / "team.json"), "--lockstep", *more)
        return self._start(side, "standby" if more else "coordinator", "-m", "touchline", *command)

    def said(self, name: str) -> str:
        return (self.folder / f"{name}.log").read_text()

    def begin(self, *, standby: bool) -> None:
        """Wait until all are there, and give the team its task."""
        heard = self.heard
        assert eventually(lambda: heard.look().ready == set(STARTS), 120.0), self.said("router-left")
        if standby:
            assert eventually(lambda: "stands by for session" in heard.look().standby, 120.0), heard.standby
        file = self.folder / "task.json"
        file.write_text(self.team.task.model_dump_json())
        assert eventually(lambda: self._operator("fleet", "task", str(file)) == 0), self.said("operator")
        assert eventually(lambda: heard.look().least_driven_m > 1.0, 60.0), heard.arrived

    def _operator(self, *command: str) -> int:
        return self._start(LEFT, "operator", "-m", "touchline", *command).wait(130.0)

    def cable(self, state: str) -> None:
        self._spaces.ip(LEFT, f"link set eth0 {state}")

    def until(self, condition: Callable[[Heard], bool], timeout_s: float = 60.0) -> None:
        assert eventually(lambda: condition(self.heard.look()), timeout_s), (
            self.heard.arrived,
            self.heard.coordinator,
            self.heard.standby,
            self.said("coordinator"),
        )

    def all_arrive(self) -> None:
        self.until(lambda heard: heard.arrived == len(STARTS), 180.0)
        assert self.heard.closest_m > BODIES_M


@pytest.fixture
def network(tmp_path: Path) -> Iterator[SplitNetwork]:
    with ExitStack() as stack:
        yield SplitNetwork(stack, tmp_path, {"kind": "goals", "goals": GOALS})


def driven_m(network: SplitNetwork) -> dict[str, float]:
    network.heard.look()
    return {name: network.heard.driven_m(name) for name in STARTS}


@pytest.mark.full
@pytest.mark.parametrize("away", [("a", "b", "c"), ("b", "c")], ids=["all", "two of three"])
def test_robots_that_are_split_from_their_coordinator_go_on_when_joined(
    network: SplitNetwork, away: tuple[str, ...]
) -> None:
    network.robots(RIGHT, *away)
    if here := STARTS.keys() - set(away):
        network.robots(LEFT, *here)
    network.coordinator(LEFT)
    network.begin(standby=False)
    network.cable("down")
    time.sleep(SPLIT_S)
    network.cable("up")
    before = driven_m(network)
    network.until(lambda heard: all(heard.driven_m(name) > before[name] + 0.5 for name in away))
    network.all_arrive()
    assert network.heard.coordinator == ""


@pytest.mark.full
def test_a_standby_that_reaches_only_some_robots_leaves_all_to_the_coordinator(network: SplitNetwork) -> None:
    network.robots(LEFT, "a")
    network.robots(RIGHT, "b", "c")
    network.coordinator(LEFT)
    network.coordinator(RIGHT, "--standby")
    network.begin(standby=True)
    network.cable("down")
    time.sleep(SPLIT_S)
    network.cable("up")
    network.until(lambda heard: "stands by for session" in heard.standby)
    network.all_arrive()
    assert network.heard.coordinator == ""


@pytest.mark.full
def test_a_coordinator_that_was_cut_off_ends_when_it_finds_its_successor(network: SplitNetwork) -> None:
    network.robots(RIGHT, *STARTS)
    first = network.coordinator(LEFT)
    network.coordinator(RIGHT, "--standby")
    network.begin(standby=True)
    network.cable("down")
    split_s = time.monotonic()
    network.until(lambda heard: heard.coordinator != "")
    time.sleep(max(SPLIT_S - (time.monotonic() - split_s), 0.0))
    network.cable("up")
    assert first.wait(30.0) != 0
    assert "another coordinator has taken over" in network.said("coordinator")
    network.all_arrive()


@pytest.mark.full
def test_a_coordinator_that_hung_and_comes_back_with_old_state_ends(network: SplitNetwork) -> None:
    network.robots(LEFT, "a")
    network.robots(RIGHT, "b", "c")
    first = network.coordinator(LEFT)
    network.coordinator(RIGHT, "--standby")
    network.begin(standby=True)
    first.send_signal(signal.SIGSTOP)
    network.until(lambda heard: heard.coordinator != "")
    before = driven_m(network)
    time.sleep(SPLIT_S)
    assert all(now > before[name] for name, now in driven_m(network).items())
    first.send_signal(signal.SIGCONT)
    assert first.wait(30.0) != 0
    assert "another coordinator has taken over" in network.said("coordinator")
    network.all_arrive()
