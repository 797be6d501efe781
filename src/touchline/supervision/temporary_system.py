"""Planner, robots and bridge as processes of this machine, on a private or given bus."""

import os
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from touchline.bus import Bus, BusConfig, HealthReporter
from touchline.bus.health import STARTING
from touchline.bus.ports import free_port
from touchline.bus.presence import Presence
from touchline.schemas import topics
from touchline.schemas.bus_variables import IDENTITY_VARIABLE
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.fleet import Fleet
from touchline.schemas.messages import DiagnosticArray, Event, Header, Time
from touchline.schemas.roles import Role
from touchline.schemas.setup import Setup
from touchline.security.identity import Identity
from touchline.supervision.service_log import log_folder
from touchline.supervision.supervisor import Child, Notice, Supervisor

#: A first start compiles the kernels, which takes minutes on a small computer; a later one takes a second or two.
_START_TIMEOUT_S = 600.0
_WATCH_PERIOD_S = 0.02
#: A robot whose loop hangs is out of control, and comes back with brakes on and valve closed; nobody waits longer.
_ROBOT_PATIENCE_S = 3.0
#: Services that hang with a plan or a recording get more time to recover; the robot goes on meanwhile.
_PATIENCE_S = 10.0
#: Most events that wait for a router.
_MOST_UNPUBLISHED = 1000


@dataclass
class LocalSystem:
    """Planner, robots and bridge as processes.

    Attributes:
        buses: Bus of each robot.
        presences: Presence by robot.
        serving: Nodes that serve every robot once the system is ready.
    """

    buses: Sequence[Bus]
    supervisor: Supervisor
    presences: Mapping[str, Presence]
    serving: Collection[str]
    health: Sequence[HealthReporter] = ()

    @property
    def bus(self) -> Bus:
        """Bus of the first robot."""
        return self.buses[0]

    @property
    def presence(self) -> Presence:
        """Presence of the first robot."""
        return self.presences[self.bus.namespace]

    def poll(self) -> list[Notice]:
        """Watch the services and restart what died; return the events."""
        for presence in self.presences.values():
            presence.poll()
        for reporter in self.health:
            reporter.poll({})
        return self.supervisor.poll(self.presences)

    def wait_until_ready(self, tell: Callable[[str], None], enough: Callable[[], bool] = lambda: False) -> bool:
        """Wait until every service answers, passing on their messages.

        Args:
            tell: Called with messages of starting services.
            enough: Whether to stop waiting.

        Returns:
            Whether they all answer.

        Raises:
            TouchlineError: One keeps failing, or the wait was too long.
        """
        inboxes = [bus.inbox([topics.DIAGNOSTICS]) for bus in self.buses]
        start = _Start(len(inboxes), self.serving, tell)
        deadline = time.monotonic() + _START_TIMEOUT_S
        while not start.done:
            if enough():
                return False
            for notice in self.poll():
                if notice.kind != "died":
                    tell(notice.text)
                else:
                    tail = self.supervisor.log_tail(notice.node, "".join(notice.robots))
                    raise TouchlineError(f"{notice.text} while starting; its last words:\n{tail}")
            for number, inbox in enumerate(inboxes):
                for _, message in inbox.messages():
                    if isinstance(message, DiagnosticArray):
                        start.hear(number, message)
            if time.monotonic() > deadline:
                raise TouchlineError(f"{start.missing} did not become ready in {_START_TIMEOUT_S:.0f} s")
            time.sleep(0.005)
        return True


class _Start:
    """Services that do not serve every robot yet, and their messages."""

    def __init__(self, robots: int, serving: Collection[str], tell: Callable[[str], None]) -> None:
        self._waiting = {(number, node) for number in range(robots) for node in serving}
        self._said: dict[str, str] = {}
        self._tell = tell

    @property
    def done(self) -> bool:
        """True if all serve."""
        return not self._waiting

    @property
    def missing(self) -> str:
        """Services that do not serve yet, as text."""
        return ", ".join(sorted({node for _, node in self._waiting}))

    def hear(self, robot: int, message: DiagnosticArray) -> None:
        """Take a service's diagnostics for a robot."""
        for status in message.status:
            if not status.message.startswith(STARTING):
                self._waiting.discard((robot, status.name))
            elif self._said.get(status.name) != status.message:
                self._said[status.name] = status.message
                self._tell(f"{status.name}: {status.message}")


@dataclass(frozen=True)
class ProcessOptions:
    """Options of a system's processes.

    Attributes:
        robot_sim: Further options of ``touchline robot-sim``.
        bridge: Further options of ``touchline bridge``.
        recordings: Folder of recordings; by default the present one.
        apart: Whether each robot has its own process.
        without: Nodes that this job does not need and that are not started.
        coordinator: Options of ``touchline coordinator``, if there is to be one.
        logs: Folder of the services' log files; by default that of the user.
        identities: Of a secured system's processes, by role, and of its robots, by namespace; none of an open one.
    """

    robot_sim: Sequence[str] = ()
    bridge: Sequence[str] = ()
    recordings: Path | None = None
    apart: bool = False
    without: Collection[str] = ()
    coordinator: Sequence[str] | None = None
    logs: Path | None = None
    identities: Mapping[Role | str, Identity] = field(default_factory=dict)


_USUAL = ProcessOptions()


@contextmanager
def local_system(
    robots: Mapping[str, Setup],
    config: BusConfig | None = None,
    options: ProcessOptions = _USUAL,
    *,
    join_as: str = topics.OPERATOR,
) -> Iterator[LocalSystem]:
    """Start planner, robots and bridge, and stop them at the end.

    Args:
        robots: Vehicle, computer and world of each robot, by namespace.
        config: The bus to use; by default a private one, so that several jobs can run at once.
        options: Options of the processes.
        join_as: Name of this process on the bus. The operator attends to a job, and the robot drives while one is
            there;
            the supervisor attends to processes and publishes its health, and on a given bus its robots come back
            another time: what their journals hold, such as an emergency stop, is kept for that.

    Raises:
        SpecError: An identity is given, which the processes would not use.
    """
    if not options.identities and os.environ.get(IDENTITY_VARIABLE):
        problem = "is given, but what is started here has no identities: anybody on this machine could command it"
        remedy = f"add --secure, or --robot for a robot of a system that runs; or unset {IDENTITY_VARIABLE}"
        raise SpecError("command line", "--identity", problem, remedy)
    lasting = config is not None and join_as == topics.SUPERVISOR
    identities = options.identities
    protocol = "tls" if identities else "tcp"
    config = (config or BusConfig(endpoint=f"{protocol}/127.0.0.1:{free_port()}")).of(*robots)
    if identities:
        config = config.as_identity(identities[topics.ROLE_OF_NODE[join_as]])
    with tempfile.TemporaryDirectory(prefix="touchline-") as folder, ExitStack() as stack:
        children = _children(robots, options, Path(folder), lasting=lasting)
        supervisor = Supervisor(children, config, Path(folder), (options.logs or log_folder()).absolute())
        stack.callback(supervisor.stop)
        _start_router(supervisor)
        # The bus before the other processes: an unusable endpoint is reported before anything is started.
        buses = stack.enter_context(Bus.open_all(join_as, config))
        stack.callback(supervisor.stop)  # while their messages are still heard here
        supervisor.start()
        health = [HealthReporter(bus) for bus in buses] if join_as == topics.SUPERVISOR else []
        presences = {bus.namespace: bus.presence() for bus in buses}
        if options.coordinator is not None:
            presences[topics.TEAM_NAMESPACE] = buses[0].of(topics.TEAM_NAMESPACE).presence()
        serving = [node for node in topics.SERVING if node not in options.without]
        yield LocalSystem(buses, supervisor, presences, serving, health)


def _children(robots: Mapping[str, Setup], options: ProcessOptions, folder: Path, *, lasting: bool) -> list[Child]:
    """Return all processes, a secured system's router first; none has been started."""
    children = _robot_children(robots, options, folder, lasting=lasting)
    if topics.PLANNER not in options.without:
        children.append(Child(topics.PLANNER, ["planner", "--robots", _robots(robots, folder)], _PATIENCE_S))
    if topics.BRIDGE not in options.without:
        recordings = (options.recordings or Path()).absolute()
        command = ["bridge", *options.bridge, "--recordings", str(recordings)]
        beside = (topics.TEAM_NAMESPACE,) if options.coordinator is not None else ()
        children.append(Child(topics.BRIDGE, command, _PATIENCE_S, beside=beside))
    if options.coordinator is not None:
        command = ["coordinator", *options.coordinator]
        children.append(Child(topics.COORDINATOR, command, _PATIENCE_S, topics.TEAM_NAMESPACE))
    if options.identities:
        children.insert(0, Child(Role.ROUTER, ["router"], _ROBOT_PATIENCE_S, carries_all=True))
        for child in children:
            if child.identity is None:
                child.identity = options.identities[topics.ROLE_OF_NODE.get(child.node, child.node)]
    return children


def _start_router(supervisor: Supervisor) -> None:
    """Start what carries all messages, and wait until it does.

    Raises:
        TouchlineError: It has died.
    """
    supervisor.start_first()
    while not supervisor.carries:
        for notice in supervisor.poll():
            if notice.kind == "died":
                raise TouchlineError(f"{notice.text}; its last words:\n{supervisor.log_tail(notice.node)}")
        time.sleep(_WATCH_PERIOD_S)


def _robot_children(
    robots: Mapping[str, Setup], options: ProcessOptions, folder: Path, *, lasting: bool
) -> list[Child]:
    """Return the robots' process, or processes; robots of one job end with it, and so do their journals."""
    apart = options.apart or bool(options.identities)
    groups = [{name: setup} for name, setup in robots.items()] if apart else [dict(robots)]
    children = []
    for number, group in enumerate(groups):
        path = folder / f"robots-{number}.json"
        path.write_text(Fleet.of(group).model_dump_json(), encoding="utf-8")
        journal = [] if lasting else ["--journal", str(folder)]
        alone = next(iter(group)) if len(groups) > 1 else ""
        command = ["robot-sim", "--robots", str(path), *options.robot_sim, *journal]
        own = options.identities.get(next(iter(group)))
        children.append(Child(topics.ROBOT_SIM, command, _ROBOT_PATIENCE_S, alone, identity=own))
    return children


def _robots(robots: Mapping[str, Setup], folder: Path) -> str:
    """Write a file of all robots, for whose vehicles the planner compiles kernels; it plans for that of a request."""
    path = folder / "robots.json"
    path.write_text(Fleet.of(robots).model_dump_json(), encoding="utf-8")
    return str(path)


def severity_of(notice: Notice) -> int:
    """Return the severity of a notice, as in ``touchline_msgs/Event``."""
    return Event.ERROR if notice.kind in ("died", "hangs", "hung") else Event.WARN


def publish_notices(system: LocalSystem, until: Callable[[], bool], tell: Callable[[Notice], None]) -> None:
    """Watch the services until ``until()``, and report events to ``tell`` and on the bus, once a router is there."""
    publishers = {bus.namespace: bus.publisher(topics.SUPERVISOR_EVENTS) for bus in system.buses}
    unpublished: deque[tuple[str, Event]] = deque(maxlen=_MOST_UNPUBLISHED)
    while not until():
        for notice in system.poll():
            tell(notice)
            unpublished.extend((namespace, _event(notice)) for namespace in notice.robots or publishers)
        while unpublished and system.supervisor.heard:
            namespace, event = unpublished.popleft()
            publishers[namespace].send(event)
        time.sleep(_WATCH_PERIOD_S)


@contextmanager
def watched(system: LocalSystem) -> Iterator[None]:
    """Run :func:`publish_notices` in the background."""
    done = threading.Event()
    watcher = threading.Thread(target=publish_notices, args=(system, done.is_set, lambda notice: None))
    watcher.start()
    try:
        yield
    finally:
        done.set()
        watcher.join()


def _event(notice: Notice) -> Event:
    """Return a notice as the console shows it; its stamp is wall-clock time."""
    return Event(
        header=Header(stamp=Time.of_ns(time.time_ns())),
        severity=severity_of(notice),
        source=topics.SUPERVISOR,
        code=notice.kind,
        text=notice.text,
    )
