"""Filter for status messages and reports of an earlier job.

Messages that are kept for late joiners, and those in transit, arrive after the robot has taken another job.
"""

import math

from touchline.schemas.messages import AreaReport, ContactReport, TraversalReport, TraversalStatus


class JobMessageFilter:
    """Accepts messages about the present job; none before the robot has reported that it is ready.

    Attributes:
        since_s: Sim time of that report; infinite before it.
    """

    def __init__(self) -> None:
        """Start without a job."""
        self.since_s = math.inf

    def forget(self) -> None:
        """Reset before another job."""
        self.since_s = math.inf

    @property
    def begun(self) -> bool:
        """True if the robot has reported that it is ready."""
        return math.isfinite(self.since_s)

    def status(self, status: TraversalStatus) -> bool:
        """Return whether a status belongs to the job; statuses arrive in the order of sending."""
        if not self.begun and status.state == TraversalStatus.READY:
            self.since_s = status.header.stamp.seconds
        return self.begun

    def report(self, report: TraversalReport | AreaReport | ContactReport) -> bool:
        """Return whether a report belongs to the job."""
        return report.header.stamp.seconds > self.since_s
