"""Shows a job over the bus on the terminal, and ends it when what it needs has died."""

from collections.abc import Callable
from dataclasses import dataclass, field

from touchline.cli.display import Advance, print_event
from touchline.jobs.watcher import JobFailed
from touchline.schemas import topics
from touchline.supervision.temporary_system import LocalSystem, severity_of


@dataclass
class Terminal:
    """Shows a job on standard error, and ends it when the robot's process dies.

    Attributes:
        advance: The bar.
        watch: Called often; raises `JobFailed` when the robot's process has died.
    """

    advance: Advance
    watch: Callable[[], None]
    _stage: str = field(default="", init=False)

    def stage(self, text: str) -> None:
        """Name the stage."""
        self._stage = text
        self.advance(0.0, text)

    def progress(self, fraction: float, text: str) -> None:
        """Move the bar."""
        self.advance(fraction, f"{self._stage}: {text}")

    def event(self, severity: int, text: str) -> None:
        """Print an event."""
        print_event(severity, text)

    def check(self) -> None:
        """Tell what happened to the services."""
        self.watch()


def watch_system(system: LocalSystem) -> None:
    """Tell what happened to the services of a job.

    Raises:
        JobFailed: The robot's process has died.
    """
    for notice in system.poll():
        print_event(severity_of(notice), f"supervisor: {notice.text}")
        if notice.node == topics.ROBOT_SIM and notice.kind in ("died", "hung"):
            raise JobFailed(f"{notice.text}; its traversal is lost, what was recorded until then is kept")


def watch_team(system: LocalSystem) -> None:
    """Tell what happened to the services of a job of several robots, each of a process of its own.

    That one of those has died the others hear on the bus.
    """
    for notice in system.poll():
        print_event(severity_of(notice), f"supervisor: {notice.text}")
