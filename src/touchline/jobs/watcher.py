"""Interface of a job's observer, and the error of a job that ended early."""

from typing import Protocol

from touchline.schemas.errors import TouchlineError


class JobFailed(TouchlineError):
    """The job ended early; the text is the reason."""


class Watcher(Protocol):
    """Observer of a job."""

    def stage(self, text: str) -> None:
        """Report that a new stage begins."""

    def progress(self, fraction: float, text: str) -> None:
        """Report the fraction done of the present stage, 0…1."""

    def event(self, severity: int, text: str) -> None:
        """Report an event; ``severity`` as in ``touchline_msgs/Event``."""

    def check(self) -> None:
        """Check the system, often; raises :class:`JobFailed` when the job cannot continue."""
