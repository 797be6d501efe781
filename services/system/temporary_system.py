"""A whole system on this machine for one job: services, a bus of their own, and an end to it all."""

import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import DiagnosticArray, Event, Header, Time
from touchline.schemas.setup import Setup
from touchline.schemas.spec import Spec
from touchline.services.bus import Bus, BusConfig, HealthReporter
from touchline.services.bus.health import STARTING
from touchline.services.bus.ports import free_port
from touchline.services.bus.presence import Presence
from touchline.services.system.supervisor import Child, Notice, Supervisor

#: A first start compiles the kernels; a later one takes a second or two.
_START_TIMEOUT_S = 180.0
_WATCH_PERIOD_S = 0.02
_SERVICES = (topics.PLANNER, topics.ROBOT_SIM, topics.BRIDGE)
#: A robot whose loop hangs is out of control, and comes back with brakes on and valve closed; nobody waits longer.
_ROBOT_PATIENCE_S = 3.0
#: What hangs with a plan or a recording that could be lost gets more time to come round; the robot goes on meanwhile.
_PATIENCE_S = 10.0


@dataclass
class LocalSystem:
    """Planner, robot and bridge as processes, on ``bus``."""

    bus: Bus
    supervisor: Supervisor
    presence: Presence
    health: HealthReporter | None = None

    def poll(self) -> list[Notice]:
        """Watch the services; restarts what died."""
        self.presence.poll()
        if self.health is not None:
            self.health.poll({})
        return self.supervisor.poll(self.presence)

    def wait_until_ready(self, tell: Callable[[str], None], enough: Callable[[], bool] = lambda: False) -> bool:
        """Wait until every service answers, passing on what they say they are doing.

        Args:
            tell: Told what they do.
            enough: Whether to wait no longer.

        Returns:
            Whether they all answer.

        Raises:
            TouchlineError: One keeps failing, or the wait was too long.
        """
        inbox = self.bus.inbox([topics.DIAGNOSTICS])
        waiting = set(_SERVICES)
        said: dict[str, str] = {}
        deadline = time.monotonic() + _START_TIMEOUT_S
        while waiting:
            if enough():
                return False
            for notice in self.poll():
                if notice.kind != "died":
                    tell(notice.text)
                else:
                    tail = self.supervisor.log_tail(notice.node)
                    raise TouchlineError(f"{notice.text} while starting; its last words:\n{tail}")
            for _, message in inbox.messages():
                if isinstance(message, DiagnosticArray):
                    for status in message.status:
                        if status.message.startswith(STARTING):
                            if said.get(status.name) != status.message:
                                said[status.name] = status.message
                                tell(f"{status.name}: {status.message}")
                        else:
                            waiting.discard(status.name)
            if time.monotonic() > deadline:
                raise TouchlineError(f"{', '.join(sorted(waiting))} did not become ready in {_START_TIMEOUT_S:.0f} s")
            time.sleep(0.005)
        return True


@contextmanager
def local_system(
    setup: Setup,
    config: BusConfig | None = None,
    robot_arguments: Sequence[str] = (),
    bridge_arguments: Sequence[str] = (),
    *,
    join_as: str = topics.OPERATOR,
    recordings: Path | None = None,
) -> Iterator[LocalSystem]:
    """Start planner, robot and bridge, and stop them at the end.

    Args:
        setup: The robot, which the planner plans for, its computer and its world.
        config: The bus to use; by default a private one, so that several jobs can run at once.
        robot_arguments: Further options of ``touchline robot-sim``.
        bridge_arguments: Options of ``touchline bridge``.
        join_as: Who this process is on the bus. The operator minds a job, and the robot drives while one is there; the
            supervisor minds processes and tells how it is.
        recordings: The folder of recordings; by default the present one.
    """
    private = config is None
    config = config or BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}")
    with tempfile.TemporaryDirectory(prefix="touchline-") as folder:
        journal = ["--journal", f"{folder}/robot.journal"] if private else []  # nobody comes back to a private bus
        recorder = [*bridge_arguments, "--recordings", str((recordings or Path()).absolute())]
        vehicle = ["--vehicle", _written(setup.vehicle, Path(folder), "vehicle")]
        robot = [*vehicle, "--onboard", _written(setup.onboard, Path(folder), "onboard")]
        robot += ["--scenario", _written(setup.scenario, Path(folder), "scenario")]
        children = [
            Child(topics.ROBOT_SIM, ["robot-sim", *robot, *robot_arguments, *journal], _ROBOT_PATIENCE_S),
            Child(topics.PLANNER, ["planner", *vehicle], _PATIENCE_S),
            Child(topics.BRIDGE, ["bridge", *recorder], _PATIENCE_S),
        ]
        # The bus first: should its endpoint be of no use, that is told before anything is started.
        with Bus.open(join_as, config) as bus:
            supervisor = Supervisor(children, config, Path(folder))
            supervisor.start()
            try:
                health = HealthReporter(bus) if join_as == topics.SUPERVISOR else None
                yield LocalSystem(bus, supervisor, bus.presence(), health)
            finally:
                supervisor.stop()


def _written(spec: Spec, folder: Path, name: str) -> str:
    path = folder / f"{name}.json"
    path.write_text(spec.model_dump_json(), encoding="utf-8")
    return str(path)


def severity_of(notice: Notice) -> int:
    """How bad a notice is, as in ``touchline_msgs/Event``."""
    return Event.ERROR if notice.kind in ("died", "hangs", "hung") else Event.WARN


def publish_notices(system: LocalSystem, until: Callable[[], bool], tell: Callable[[Notice], None]) -> None:
    """Watch the services until ``until()``, telling ``tell`` and everyone on the bus what happens to them."""
    publisher = system.bus.publisher(topics.SUPERVISOR_EVENTS)
    while not until():
        for notice in system.poll():
            tell(notice)
            publisher.send(_event(notice))
        time.sleep(_WATCH_PERIOD_S)


@contextmanager
def watched(system: LocalSystem) -> Iterator[None]:
    """:func:`publish_notices` in the background."""
    done = threading.Event()
    watcher = threading.Thread(target=publish_notices, args=(system, done.is_set, lambda notice: None))
    watcher.start()
    try:
        yield
    finally:
        done.set()
        watcher.join()


def _event(notice: Notice) -> Event:
    """A notice as the console shows it; its stamp is wall-clock time."""
    return Event(
        header=Header(stamp=Time.of_ns(time.time_ns())),
        severity=severity_of(notice),
        source=topics.SUPERVISOR,
        code=notice.kind,
        text=notice.text,
    )
