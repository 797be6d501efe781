"""Calibration drive of a robot on the bus."""

from __future__ import annotations

import uuid
from dataclasses import dataclass, field
from typing import ClassVar

from touchline.bus import Inbox
from touchline.jobs.calibration.rest_schedule import RestSchedule
from touchline.jobs.single.bus_run import BusRun
from touchline.jobs.watcher import JobFailed
from touchline.schemas import topics
from touchline.schemas.messages import AuthorizeRequest, Odometry, PlanResponse, TraversalStatus
from touchline.schemas.plan_cause import PlanCause
from touchline.services.planner.calibration_drive import CalibrationDrive


@dataclass
class CalibrationRun(BusRun):
    """A calibration drive in progress: the robot is authorized to drive from rest to rest.

    Attributes:
        drive: The planned drive.
    """

    drive: CalibrationDrive = field(kw_only=True)
    doing: ClassVar[str] = "Driving"
    _schedule: RestSchedule = field(init=False)
    _latest: Inbox = field(init=False)
    _status: TraversalStatus = field(default=TraversalStatus(), init=False)
    _odometry: Odometry = field(default=Odometry(), init=False)

    def __post_init__(self) -> None:
        """Listen to the robot's motion."""
        self._schedule = RestSchedule(self.drive.rests)
        self._latest = self.bus.inbox([topics.STATUS, topics.ODOMETRY], keep="latest")

    def _plan(self) -> PlanResponse:
        plan = self.drive.plan
        return PlanResponse(success=True, trajectory=plan.trajectory, report=plan.report)

    def _cause(self, plan: PlanResponse) -> PlanCause:
        return self.drive.cause

    def _before_start(self) -> None:
        self._authorize()

    def _each_turn(self) -> None:
        for _, message in self._latest.messages():
            if isinstance(message, TraversalStatus) and message.header.stamp.seconds >= self._of_job.since_s:
                self._status = message
            elif isinstance(message, Odometry):
                self._odometry = message
        twist, time_s = self._odometry.twist.twist, self._odometry.header.stamp.seconds
        if self._schedule.look(time_s, self._status.arc_length_m, twist.linear.x, twist.angular.z):
            self._authorize()

    def _authorize(self) -> None:
        request = AuthorizeRequest(request_id=uuid.uuid4().hex, until_m=self._schedule.until_m)
        answer = self._ask(topics.AUTHORIZE, request)
        if not answer.success:
            raise JobFailed(f"the robot refused to drive on: {answer.message}")
