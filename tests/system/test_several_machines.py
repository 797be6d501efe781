"""A system of several machines, each a network namespace, by the commands of the systemd units that ship."""

import configparser
import os
import re
import select
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.system.namespaces import Namespaces
from touchline.schemas.roles import Role
from touchline.security.authority import CertificateAuthority

UNITS = Path(__file__).parents[2] / "deploy" / "systemd"
MACHINES = ("router", "planner", "bridge", "r1", "r2", "operator")
INSTALLED = "/opt/touchline/bin/touchline"
HERE = str(Path(sys.executable).with_name("touchline"))
#: A first start compiles kernels.
STARTED_S = 600.0


def settings(unit: str) -> Mapping[str, str]:
    """Section `Service` of a unit, as systemd reads it; lists of several lines as the last of them."""
    parser = configparser.ConfigParser(strict=False, interpolation=None, delimiters="=")
    parser.optionxform = str  # type: ignore[assignment, method-assign]
    parser.read([UNITS / unit, UNITS / "touchline-.service.d" / "common.conf"])
    return parser["Service"]


#: Address of the first machine, the router's.
NET, FIRST, PORT = "10.9.0", 1, 7461


class Machines:
    """Network namespaces that one switch connects; the first has the address at which the router listens."""

    def __init__(self, stack: ExitStack, folder: Path) -> None:
        self.folder = folder
        self._stack = stack
        self._spaces = Namespaces(stack, ("switch", *MACHINES))
        self._spaces.ip("switch", "link add br0 type bridge", "link set br0 up")
        for number, name in enumerate(MACHINES, FIRST):
            self._spaces.ip("switch", f"link add {name} type veth peer name eth0 netns {self._spaces.holders[name]}")
            self._spaces.ip("switch", f"link set {name} master br0 up")
            self._spaces.ip(name, "link set lo up", f"addr add {NET}.{number}/24 dev eth0", "link set eth0 up")

        self._issue()

    def _issue(self) -> None:
        """Make the identities; all machines see the same folder."""
        authority = CertificateAuthority.create(self.folder / "touchline" / "keys", f"tls/{NET}.{FIRST}:{PORT}")
        for role, name in ((Role.PLANNER, "main"), (Role.BRIDGE, "main"), (Role.OPERATOR, "anna")):
            authority.issue([authority.new_member(role, name)])
        for name in ("r1", "r2"):
            host = f"{NET}.{FIRST + MACHINES.index(name)}"
            authority.issue([authority.new_member(Role.ROBOT, name, [host])])

    def cable(self, machine: str, state: str) -> None:
        """Connect a machine (`up`), or cut it off (`down`)."""
        self._spaces.ip("switch", f"link set {machine} {state}")

    def start(self, unit: str, machine: str) -> "Service":
        """Start a unit; with an `@` as the instance of this name."""
        given, specifiers = settings(unit), {"%i": machine, "%S": str(self.folder), "%t": str(self.folder / machine)}
        specifiers["%C"] = os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache"))

        def filled(text: str) -> str:
            return re.sub("%.", lambda found: specifiers[found[0]], text)

        identities = str(self.folder / "touchline" / "keys" / "identities")
        command = filled(given["ExecStart"]).replace("/etc/touchline/identities", identities)
        environment = dict(each.split("=", 1) for each in filled(given["Environment"]).split())
        for folder in (self.folder / "touchline" / "recordings", self.folder / machine):
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        ready = self._stack.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM))
        ready.bind(str(self.folder / machine / "notify"))
        with (self.folder / f"{machine}.journal").open("wb") as output:
            process = subprocess.Popen(
                [*self._spaces.on(machine), *shlex.split(command.replace(INSTALLED, HERE))],
                env={**self.environment(), **environment, "NOTIFY_SOCKET": ready.getsockname()},
                cwd=self.folder,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
            )
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        return Service(process, ready, self.folder / f"{machine}.journal")

    def environment(self) -> dict[str, str]:
        """Variables of all processes."""
        return {**os.environ, "XDG_CONFIG_HOME": str(self.folder), "COLUMNS": "200"}

    def operator(self, *arguments: str) -> "subprocess.Popen[str]":
        """Start a command on the operator's machine."""
        process = subprocess.Popen(
            [*self._spaces.on("operator"), HERE, *arguments],
            env={**self.environment(), "TOUCHLINE_IDENTITY": "operator.anna"},
            cwd=self.folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert process.stdout is not None
        self._stack.callback(process.stdout.close)
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        return process


class Service:
    """Process of a unit."""

    def __init__(self, process: "subprocess.Popen[bytes]", ready: socket.socket, journal: Path) -> None:
        self._process, self._ready, self._journal = process, ready, journal

    def wait_until_ready(self) -> None:
        """Wait for its message to the service manager."""
        until_s = time.monotonic() + STARTED_S
        while not select.select([self._ready], [], [], 0.1)[0]:
            assert time.monotonic() < until_s, self.said()
            self.said()
        assert self._ready.recv(100) == b"READY=1"

    def said(self) -> str:
        """Everything that it has logged so far."""
        assert self._process.poll() is None, self._journal.read_text()
        return self._journal.read_text()

    def freeze(self, frozen: bool) -> None:
        """Stop the process, or let it go on."""
        self._process.send_signal(signal.SIGSTOP if frozen else signal.SIGCONT)

    def stop(self) -> int:
        """Exit code after SIGTERM."""
        self._process.terminate()
        return self._process.wait(60.0)


@pytest.fixture
def machines(tmp_path: Path) -> Iterator[Machines]:
    with ExitStack() as stack:
        yield Machines(stack, tmp_path)


def wait_for(condition: Callable[[], bool], why: Callable[[], str]) -> None:
    until_s = time.monotonic() + 120.0
    while not condition():
        assert time.monotonic() < until_s, why()
        time.sleep(0.05)


def test_a_job_a_stop_and_a_cut_cable(machines: Machines) -> None:
    services = {name: machines.start(f"touchline-{name}.service", name) for name in ("router", "planner", "bridge")}
    services |= {name: machines.start("touchline-robot@.service", name) for name in ("r1", "r2")}
    for service in services.values():
        service.wait_until_ready()

    recording = machines.folder / "touchline" / "recordings" / "square.mcap"
    job = machines.operator("run", "study-square", "--robot", "r1", "--speed", "20", "--record", str(recording))
    said, _ = job.communicate(timeout=300.0)
    assert job.returncode == 0, said
    assert recording.is_file()

    machines.operator("run", "study-square", "--robot", "r2", "--speed", "1")
    wait_for(lambda: "r2: running" in services["r2"].said(), services["r2"].said)
    machines.cable("r2", "down")
    wait_for(lambda: "r2: paused" in services["r2"].said(), services["r2"].said)  # by itself
    machines.cable("r2", "up")
    wait_for(lambda: _stopped(machines) == {"r1", "r2"}, services["r2"].said)
    assert "r2: emergency-stopped" in services["r2"].said()

    wait_for(lambda: _reset(machines, "r1"), services["r1"].said)  # refused within a second of the stop
    services["router"].freeze(True)
    assert _stopped(machines) == {"r1", "r2"}  # at their own doors
    services["router"].freeze(False)
    wait_for(lambda: services["r1"].said().count("r1: emergency-stopped") == 2, services["r1"].said)
    assert [service.stop() for service in services.values()] == [0] * len(services)


def _reset(machines: Machines, robot: str) -> bool:
    order = machines.operator("order", "reset", "--robot", robot)
    order.communicate(timeout=60.0)
    return order.returncode == 0


def _stopped(machines: Machines) -> set[str]:
    """Stop every robot on the bus; return those that have acknowledged."""
    order = machines.operator("order", "estop")
    said, _ = order.communicate(timeout=60.0)
    return set(re.findall(r"^(\w+): estop: done$", said, re.MULTILINE))


def test_systemd_can_read_the_units(tmp_path: Path) -> None:
    if shutil.which("systemd-analyze") is None:
        pytest.skip("there is no systemd-analyze")
    command = tmp_path / INSTALLED.removeprefix("/")
    command.parent.mkdir(parents=True)
    command.touch(0o755)
    units = tmp_path / "etc" / "systemd" / "system"
    shutil.copytree(UNITS, units)
    for target in ("sysinit", "basic", "shutdown", "network-online", "multi-user"):
        (units / f"{target}.target").write_text("[Unit]\n")
    names = sorted(unit.name for unit in units.glob("*.service"))
    assert len(names) == 4
    done = subprocess.run(
        ["systemd-analyze", f"--root={tmp_path}", "verify", *(name.replace("@", "@r1") for name in names)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
