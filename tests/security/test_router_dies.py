"""The router of `up --secure` is killed, and freezes, while a robot drives: what everybody says, and what goes on."""

import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.meeting import eventually
from tests.security.secured_system import ROBOTS, SecuredSystem, secured_system
from tests.system.test_failures import LONG_LINE, new_id, planned, start_painting
from touchline.bus import Bus, UrgentOrder, repeat_until_acknowledged
from touchline.schemas import topics
from touchline.schemas.messages import CommandRequest, Event, TraversalStatus
from touchline.schemas.roles import Role
from touchline.tui.link import BusLink
from touchline.tui.protocol import Incoming, LinkChanged, NodeChanged, Received

pytestmark = pytest.mark.xdist_group("secured system")


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SecuredSystem]:
    with secured_system(tmp_path_factory.mktemp("secured")) as running:
        yield running


def services(system: SecuredSystem) -> dict[int, str]:
    """Subcommands of the processes that `up` has started, by their ids."""
    listed = ["ps", "--ppid", str(system.process.pid), "-o", "pid=,args="]
    lines = subprocess.run(listed, stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()
    return {int(line.split()[0]): line.partition(" -m touchline ")[2].split()[0] for line in lines}


class Console:
    """Follows the console's link to the first robot, and the log of `up`."""

    def __init__(self, bus: Bus, log: Path) -> None:
        self._link, self._log = BusLink(bus), log
        self._link.attend(closely=True)
        self.heard: list[Incoming] = []

    def hears(self, wanted: Callable[[Incoming], bool]) -> bool:
        def heard() -> bool:
            self.heard += self._link.poll()
            return any(map(wanted, self.heard))

        return eventually(heard)

    def hears_event(self, code: str) -> bool:
        return self.hears(
            lambda each: isinstance(each, Received) and isinstance(each.message, Event) and each.message.code == code
        )

    def state(self) -> int | None:
        """The last state of the robot's traversal among what was heard."""
        states = [
            each.message.state
            for each in self.heard
            if isinstance(each, Received) and isinstance(each.message, TraversalStatus)
        ]
        return states[-1] if states else None

    def nodes(self, *, alive: bool) -> set[str]:
        """Processes that came, or went, among what was heard."""
        return {each.node for each in self.heard if isinstance(each, NodeChanged) and each.alive == alive}

    def forget(self) -> None:
        self.heard.clear()

    def is_told(self, text: str) -> bool:
        """Return whether `up` prints it."""
        return eventually(lambda: text in self._log.read_text())


@pytest.fixture(scope="module")
def console(system: SecuredSystem) -> Iterator[Console]:
    with Bus.open(topics.OPERATOR, system.config(Role.OPERATOR)) as bus:
        console = Console(bus, system.log)
        start_painting(bus, planned(bus, LONG_LINE), 1.0, LONG_LINE)
        assert console.hears(lambda _: console.state() == TraversalStatus.RUNNING)
        yield console


def send(system: SecuredSystem, signal_: signal.Signals) -> dict[int, str]:
    """Send a signal to the router; return the other processes."""
    running = services(system)
    (router,) = (pid for pid, name in running.items() if name == Role.ROUTER)
    os.kill(router, signal_)
    return {pid: name for pid, name in running.items() if pid != router}


def comes_back(system: SecuredSystem, console: Console, others: dict[int, str]) -> None:
    """Check what is told, and that all others go on in the same processes with the identities that they had."""
    assert console.hears(lambda each: each == LinkChanged(False))
    assert console.hears(lambda each: each == LinkChanged(True))
    assert console.hears_event("died")
    assert console.hears_event("restarted")
    assert console.hears(lambda _: console.nodes(alive=False) <= console.nodes(alive=True))
    assert console.hears(lambda _: console.state() is not None)
    assert others.items() <= services(system).items()


def test_a_router_that_is_killed_is_told_and_started_again(system: SecuredSystem, console: Console) -> None:
    others = send(system, signal.SIGKILL)
    assert console.is_told("router was ended by SIGKILL")
    comes_back(system, console, others)


def test_while_a_router_is_frozen_robots_stop_at_their_own_doors(system: SecuredSystem, console: Console) -> None:
    console.forget()
    others = send(system, signal.SIGSTOP)
    order = UrgentOrder(topics.ESTOP, CommandRequest(request_id=new_id()), 60.0, everyone=True)
    config = system.config(Role.OPERATOR)
    answers = dict(repeat_until_acknowledged(order, topics.OPERATOR, config, lambda _: None))
    assert {name: answer.success for name, answer in answers.items()} == dict.fromkeys(ROBOTS, True)
    assert console.is_told("router was killed: its loop has not turned for 3 s")
    comes_back(system, console, others)
    assert console.hears(lambda _: console.state() == TraversalStatus.ESTOPPED)
