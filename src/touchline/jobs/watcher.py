"""Interface of whoever watches a job, and the error of a job that ended early."""

from typing import Protocol

from touchline.schemas.errors import TouchlineError


class JobFailed(TouchlineError):
    """The job ended early; the text is the reason."""


class Watcher(Protocol):
    """Somebody who watches a job."""

    def stage(self, text: str) -> None:
        """A new stage begins."""

    def progress(self, fraction: float, text: str) -> None:
        """The present stage has come so far, 0…1."""

    def event(self, severity: int, text: str) -> None:
        """Something happened; ``severity`` as in ``touchline_msgs/Event``."""

    def check(self) -> None:
        """Called often; raises :class:`JobFailed` when the job cannot go on."""
