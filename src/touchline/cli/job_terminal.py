"""Progress of a job over the bus on the terminal, which ends the job if a process that it needs dies."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from touchline.cli.display import Advance, print_event
from touchline.jobs.watcher import JobFailed
from touchline.schemas import topics

if TYPE_CHECKING:
    from touchline.supervision.temporary_system import LocalSystem


@dataclass
class Terminal:
    """Progress of a job on standard error, which ends the job if the robot's process dies.

    Attributes:
        advance: Moves the progress bar.
        watch: Called often; raises `JobFailed` when the robot's process has died.
    """

    advance: Advance
    watch: Callable[[], None]
    _stage: str = field(default="", init=False)

    def stage(self, text: str) -> None:
        """Show the name of the present stage."""
        self._stage = text
        self.advance(0.0, text)

    def progress(self, fraction: float, text: str) -> None:
        """Move the progress bar."""
        self.advance(fraction, f"{self._stage}: {text}")

    def event(self, severity: int, text: str) -> None:
        """Print an event of a robot."""
        print_event(severity, text)

    def check(self) -> None:
        """Report changes of the services.

        Raises:
            JobFailed: The robot's process has died.
        """
        self.watch()


def watch_system(system: "LocalSystem") -> None:
    """Report changes of the services of a job.

    Raises:
        JobFailed: The robot's process has died.
    """
    from touchline.supervision.temporary_system import severity_of

    for notice in system.poll():
        print_event(severity_of(notice), f"supervisor: {notice.text}")
        if notice.node == topics.ROBOT_SIM and notice.kind in ("died", "hung"):
            raise JobFailed(f"{notice.text}; its traversal is lost, what was recorded until then is kept")


def watch_team(system: "LocalSystem") -> None:
    """Report changes of the services of a job in which each robot has its own process.

    The other robots learn of a death on the bus.
    """
    from touchline.supervision.temporary_system import severity_of

    for notice in system.poll():
        print_event(severity_of(notice), f"supervisor: {notice.text}")
