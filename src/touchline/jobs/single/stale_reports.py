"""Tells what a robot says of the job that it was given last from what it said before.

Messages that are kept for late joiners, and those that are under way, arrive after the robot has taken another job.
"""

import math

from touchline.schemas.messages import AreaReport, TraversalReport, TraversalStatus


class SaidOfJob:
    """Which messages are about the job; none before the robot has said that it is ready.

    Attributes:
        since_s: Sim time at which it did; infinite as long as it has not.
    """

    def __init__(self) -> None:
        """No job yet."""
        self.since_s = math.inf

    def forget(self) -> None:
        """It is about to be given another one."""
        self.since_s = math.inf

    @property
    def begun(self) -> bool:
        """Whether it has said that it is ready."""
        return math.isfinite(self.since_s)

    def status(self, status: TraversalStatus) -> bool:
        """Whether a status is; they arrive in the order in which they were sent."""
        if not self.begun and status.state == TraversalStatus.READY:
            self.since_s = status.header.stamp.seconds
        return self.begun

    def report(self, report: TraversalReport | AreaReport) -> bool:
        """Whether a report is."""
        return report.header.stamp.seconds > self.since_s
