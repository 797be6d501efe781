"""An emergency stop while a router is frozen under a flood: a matter of order, however busy the machine is."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.meeting import eventually
from tests.system.commands import start_touchline
from tests.system.test_failures import new_id
from touchline.bus import Bus, BusConfig, UrgentOrder, repeat_until_acknowledged
from touchline.bus.ports import free_port
from touchline.schemas import topics
from touchline.schemas.messages import CommandRequest, TraversalStatus
from touchline.schemas.roles import Role
from touchline.security.authority import CertificateAuthority, issued_for_system
from touchline.security.identity import Identity

PATIENCE_S = 900.0
DEAF = """
import time
from touchline.bus import Bus
from touchline.schemas import topics
with Bus.open(topics.OBSERVER, stop=lambda: False) as bus:
    inbox = bus.inbox([topics.EVENTS, topics.STATUS])
    time.sleep(1e6)
"""
FLOOD = """
import time
from touchline.bus import Bus
from touchline.schemas import messages, topics
with Bus.open(topics.BRIDGE, stop=lambda: False) as bus:
    events, event = bus.publisher(topics.EVENTS), messages.Event(text="x" * 200_000)
    while True:
        events.send(event)
        time.sleep(0.02)
"""


class Processes:
    """Processes with identities, which end with the test."""

    def __init__(self, identities: dict[Role | str, Identity], folder: Path, stack: ExitStack) -> None:
        self._identities, self._folder, self._stack = identities, folder, stack

    def config(self, who: Role | str) -> BusConfig:
        identity = self._identities[who]
        return BusConfig(identity.access.router, ("tt2",), identity=identity)

    def start(self, command: str, who: Role | str) -> subprocess.Popen[bytes]:
        """Start a subcommand."""
        return self._kept(start_touchline(command, config=self.config(who), log=self._folder / f"{command}.log"))

    def run(self, code: str, who: Role) -> subprocess.Popen[bytes]:
        """Run code."""
        environment = {**os.environ, **self.config(who).environment()}
        return self._kept(subprocess.Popen([sys.executable, "-c", code], env=environment))

    def _kept(self, process: subprocess.Popen[bytes]) -> subprocess.Popen[bytes]:
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        return process


@pytest.fixture
def processes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Processes]:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    CertificateAuthority.create(tmp_path / "keys", f"tls/127.0.0.1:{free_port()}")
    with ExitStack() as stack:
        yield Processes(issued_for_system(tmp_path / "keys", ["tt2"]), tmp_path, stack)


def frozen(process: subprocess.Popen[bytes]) -> bool:
    return Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()[0] == "T"


def freeze(process: subprocess.Popen[bytes]) -> bool:
    process.send_signal(signal.SIGSTOP)
    return eventually(lambda: frozen(process), PATIENCE_S)


@pytest.mark.timeout(4 * PATIENCE_S)
def test_a_stop_reaches_the_robot_before_its_router_goes_on(processes: Processes) -> None:
    router = processes.start("router", Role.ROUTER)
    processes.start("robot-sim", "tt2")
    deaf, _ = processes.run(DEAF, Role.OBSERVER), processes.run(FLOOD, Role.BRIDGE)
    operator = processes.config(Role.OPERATOR)
    with Bus.open(topics.OPERATOR, operator, stop=lambda: False) as bus:
        heard, telemetry = bus.inbox([topics.STATUS], keep="latest"), bus.inbox([topics.EVENTS], keep="latest")

        def is_heard(state: int) -> bool:
            return state in {message.state for _, message in heard.messages() if isinstance(message, TraversalStatus)}

        assert eventually(lambda: is_heard(TraversalStatus.IDLE), PATIENCE_S)
        assert not bus.wait_for({topics.OBSERVER, topics.BRIDGE}, PATIENCE_S)
        assert eventually(lambda: any(len(each.payload) > 200_000 for each in telemetry.drain()), PATIENCE_S)

        assert freeze(deaf) and freeze(router)
        order = UrgentOrder(topics.ESTOP, CommandRequest(request_id=new_id()), PATIENCE_S)
        ((robot, answer),) = repeat_until_acknowledged(order, topics.OPERATOR, operator, lambda _: None)
        assert (robot, answer.success) == ("tt2", True)
        assert frozen(router)
        assert not is_heard(TraversalStatus.ESTOPPED)

        router.send_signal(signal.SIGCONT)
        assert eventually(lambda: is_heard(TraversalStatus.ESTOPPED), PATIENCE_S)
