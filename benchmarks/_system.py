"""Separate system for measurements: `touchline up` in a temporary folder, and an operator of its robot."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from benchmarks import _stranger_roles as roles
from benchmarks._processes import NODES, processes
from touchline.bus import Bus, BusConfig
from touchline.bus.ports import free_port
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.bus_variables import ENDPOINT_VARIABLE, IDENTITY_VARIABLE
from touchline.schemas.catalogue import template_text
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import Trajectory, TraversalStatus
from touchline.schemas.roles import Role
from touchline.schemas.topics import Service
from touchline.security.authority import CertificateAuthority, issued_for_system

COMMAND: Final = (sys.executable, "-m", "touchline")
ROS_DOMAIN: Final = 42
RUNNING: Final = TraversalStatus.RUNNING
STATES: Final = {
    getattr(TraversalStatus, name): name.lower()
    for name in ("IDLE", "READY", "RUNNING", "PAUSED", "DONE", "ABORTED", "ESTOPPED")
}
_START_S: Final = 180.0
_STOP_S: Final = 25.0
_ANSWER_S: Final = 10.0
_PLAN_S: Final = 300.0


class SystemLost(TouchlineError):
    """Raised when the system cannot be used any more; the text gives the reason."""


@dataclass
class System:
    """Running `touchline up`.

    Attributes:
        folder: Temporary folder; recordings go to its subfolder `recordings`, the working folder.
        config: Configuration of its bus.
        ros2_port: Port for ROS 2 nodes, if any.
        supervisor: Process of the supervisor.
        environment: Environment of its processes and its peers.
    """

    folder: Path
    config: BusConfig
    ros2_port: int
    supervisor: subprocess.Popen[bytes]
    environment: Mapping[str, str]

    @property
    def recordings(self) -> Path:
        """Folder of its recordings."""
        return self.folder / "recordings"

    @property
    def log(self) -> Path:
        """Log of `touchline up`."""
        return self.folder / "up.log"

    def processes(self) -> dict[str, int]:
        """Present process ids by name."""
        return processes(self.supervisor.pid)

    def check(self) -> None:
        """Raise `SystemLost` if the supervisor has ended."""
        if (code := self.supervisor.poll()) is not None:
            raise SystemLost(f"touchline up ended with exit code {code}: {self.last_words()}")

    def last_words(self) -> str:
        """Last line of the log of `touchline up`."""
        return (self.log.read_text(errors="replace").strip().splitlines() or [""])[-1]


@contextmanager
def running_system(
    speed: float = 1.0,
    *,
    ros2: bool = False,
    keep: Path | None = None,
    options: Sequence[str] = (),
    secured: bool = False,
) -> Iterator[System]:
    """Start a system with a separate bus and folders, wait until it is ready, and end it.

    Args:
        speed: Speed factor.
        ros2: Whether it is visible to ROS 2.
        keep: Folder for strangers' payloads that take long to make.
        options: Further options of `touchline up`.
        secured: Whether it is a secured system, whose strangers have the identity of an observer.
    """
    with tempfile.TemporaryDirectory(prefix="touchline-bench-") as name:
        folder = Path(name)
        config = _secured(folder) if secured else BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}")
        places = {"XDG_STATE_HOME": "state", "XDG_RUNTIME_DIR": "run", "XDG_CONFIG_HOME": "config"}
        for place in (*places.values(), "recordings"):
            (folder / place).mkdir(mode=0o700, exist_ok=True)
        environment = {
            **config.environment(),
            **{variable: str(folder / place) for variable, place in places.items()},
            roles.KEEP_VARIABLE: str(keep or folder),
        }
        port = free_port()
        gateway = ["--ros2", "--ros2-listen", f"tcp/127.0.0.1:{port}", "--ros-domain", str(ROS_DOMAIN)] if ros2 else []
        if ros2 and secured:
            gateway += ["--ros2-services", "*"]  # by default none that commands
        own = {IDENTITY_VARIABLE: "", ENDPOINT_VARIABLE: ""} if secured else {}
        with (folder / "up.log").open("wb") as log:
            supervisor = subprocess.Popen(
                [*COMMAND, "up", "--speed", f"{speed:g}", *gateway, *options, *(["--secure"] if secured else [])],
                cwd=folder / "recordings",
                env={**os.environ, **environment, **own},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                process_group=0,
            )
            system = System(folder, config, port, supervisor, environment)
            try:
                yield system
            finally:
                _end(system)


def _secured(folder: Path) -> BusConfig:
    """Make keys, and return the bus configuration of the operator."""
    keys = folder / "config" / "touchline" / "keys"
    CertificateAuthority.create(keys, f"tls/127.0.0.1:{free_port()}")
    identities = issued_for_system(keys, [topics.DEFAULT_NAMESPACE])
    return BusConfig(identities[Role.OPERATOR].access.router, identity=identities[Role.OPERATOR])


def _end(system: System) -> None:
    """Ask the system to stop, and end processes that do not."""
    known = system.processes() if system.supervisor.poll() is None else {}
    for pid in known.values():
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGCONT)
    system.supervisor.terminate()
    try:
        system.supervisor.wait(_STOP_S)
    except subprocess.TimeoutExpired:
        system.supervisor.kill()
        system.supervisor.wait()
    for name, pid in known.items():
        if name in NODES and Path(f"/proc/{pid}").exists() and _is_service(pid):
            os.kill(pid, signal.SIGKILL)


def _is_service(pid: int) -> bool:
    """True if a process id still belongs to the system: ids are reused."""
    try:
        return b"-m\0touchline\0" in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False


def new_id() -> str:
    """Create a unique request id."""
    return uuid.uuid4().hex


@dataclass
class Hand:
    """Operator of a system's robot: plans, loads, starts, resumes after stops, refills."""

    system: System
    bus: Bus
    state: int = -1
    reason: str = ""
    plans: dict[str, tuple[str, Trajectory]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Subscribe to the robot's status."""
        self.listen_anew()

    def listen_anew(self) -> None:
        """Renew the subscription, whose message count a stranger may have spoilt."""
        self._inbox = self.bus.inbox([topics.STATUS], keep="latest")

    def ready(self, patience_s: float = _START_S) -> None:
        """Wait until every service answers."""
        deadline = time.monotonic() + patience_s
        for node in NODES:
            while True:
                self.system.check()
                with suppress(TouchlineError):
                    self.bus.call(topics.diagnostics_service(node), m.GetDiagnosticsRequest(), timeout_s=2.0)
                    break
                if time.monotonic() > deadline:
                    raise SystemLost(f"{node} does not answer within {patience_s:.0f} s")

    def listen(self) -> None:
        """Process the robot's last status."""
        for _, message in self._inbox.messages():
            if isinstance(message, TraversalStatus):
                self.state, self.reason = message.state, message.reason

    def plan(self, template: str) -> tuple[str, Trajectory]:
        """Plan a template once; return its text and trajectory."""
        if template not in self.plans:
            text, _ = template_text(template)
            request = m.PlanRequest(request_id=new_id(), template_json=text)
            response = self.bus.call(topics.PLAN_SERVICE, request, _PLAN_S, self.system.check)
            if not response.success:
                raise SystemLost(f"no plan of {template}: {response.message}")
            self.plans[template] = (text, response.trajectory)
        return self.plans[template]

    def order(self, service: Service[m.CommandRequest, m.CommandResponse]) -> str:
        """Send an order; return the reason of a failure, "" on success."""
        return self._refusal(service, m.CommandRequest(request_id=new_id()), _ANSWER_S)

    def load(self, template: str, *, resume: bool = False) -> str:
        """Load a template's plan; return the reason of a refusal, "" on success."""
        text, trajectory = self.plan(template)
        request = m.LoadRequest(request_id=new_id(), trajectory=trajectory, template_json=text, resume=resume)
        return self._refusal(topics.LOAD, request, 30.0)

    def pace(self, factor: float) -> str:
        """Set the speed of sim time; return the reason of a refusal, "" on success."""
        request = m.SetSpeedRequest(request_id=new_id(), factor=factor)
        return self._refusal(topics.SET_SPEED, request, _ANSWER_S)

    def record(self, path: Path) -> str:
        """Begin to record; return the reason of a refusal, "" on success."""
        request = m.RecordRequest(request_id=new_id(), path=str(path))
        return self._refusal(topics.RECORD, request, _ANSWER_S)

    def _refusal(self, service: Service[Any, Any], request: m.Message, timeout_s: float) -> str:
        try:
            answer = self.bus.call(service, request, timeout_s, self.system.check)
        except SystemLost:
            raise
        except TouchlineError as error:
            return str(error)
        return "" if answer.success else answer.message or "refused without a reason"

    def drive(self, template: str, patience_s: float = 40.0, *, resume: bool = False) -> None:
        """Make the robot drive, from any state: reset, load, start, resume, refill.

        Raises:
            SystemLost: The robot does not drive within `patience_s`.
        """
        self.plan(template)
        deadline = time.monotonic() + patience_s
        problem = ""
        while True:
            self.system.check()
            self.listen()
            if self.state == RUNNING:
                return
            if time.monotonic() > deadline:
                raise SystemLost(f"cannot be brought to drive ({STATES.get(self.state, 'silent')}): {problem}")
            step = self._step(template, resume=resume)
            problem = step or problem
            time.sleep(0.1 if step else 0.02)

    def _step(self, template: str, *, resume: bool) -> str:
        if self.state == TraversalStatus.ESTOPPED:
            return self.order(topics.RESET)
        if self.state == TraversalStatus.PAUSED:
            if refusals := self.replenish():  # as long as it brakes
                return refusals[0]
            problem = self.order(topics.RESUME)
            if "cannot resume" in problem:
                return self.order(topics.ABORT) or problem
            return problem
        if self.state == TraversalStatus.READY:
            return self.order(topics.START)
        problem = self.load(template, resume=resume)
        if problem and resume:
            problem = self.load(template)
        return problem

    def replenish(self) -> list[str]:
        """Refill the tank and replace the battery; return the refusals."""
        refusals = [self.order(service) for service in (topics.REFILL_TANK, topics.REPLACE_BATTERY)]
        return [refusal for refusal in refusals if refusal]

    def finish_recording(self, timeout_s: float = 60.0) -> str:
        """End the recording, asking again if the bridge does not answer; returns what is wrong with it, or nothing."""
        request, deadline = m.RecordStopRequest(request_id=new_id()), time.monotonic() + timeout_s
        while True:
            try:
                answer = self.bus.call(topics.RECORD_STOP, request, deadline - time.monotonic())
            except TouchlineError as error:
                if time.monotonic() > deadline - 1.0:
                    return str(error)
                time.sleep(0.2)
                continue
            if not answer.success:
                return answer.message or "not whole"
            return f"{answer.lost} messages lost" if answer.lost else ""
