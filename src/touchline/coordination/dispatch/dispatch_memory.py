"""Memory of a dispatcher, by which that of another coordinator goes on with its tasks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from touchline.coordination.dispatch.robot_records import RobotJob, RobotRecord, RobotTotals
from touchline.coordination.dispatch.task_records import TaskRecord, TaskState, stops_of
from touchline.schemas.spec import Spec
from touchline.schemas.task_requests import Point, Request, located


class TaskMemory(Spec):
    """A task, as of `TaskRecord`; times are null where that has nan."""

    id: str
    request: Request
    queued_s: float
    state: TaskState
    reason: str
    robot: str
    started_s: float | None
    finished_s: float | None
    picked_up: bool

    @classmethod
    def of(cls, record: TaskRecord) -> TaskMemory:
        """Return what is to be kept of a record."""
        return cls(
            id=record.id,
            request=record.request,
            queued_s=record.queued_s,
            state=record.state,
            reason=record.reason,
            robot=record.robot,
            started_s=_finite(record.started_s),
            finished_s=_finite(record.finished_s),
            picked_up=record.picked_up,
        )

    def record(self, places: Mapping[str, Point]) -> TaskRecord:
        """Return the record again.

        Args:
            places: Places that requests name.
        """
        return TaskRecord(
            id=self.id,
            request=self.request,
            stops=stops_of(self.request, located(self.request, places)),
            queued_s=self.queued_s,
            state=self.state,
            reason=self.reason,
            robot=self.robot,
            started_s=_or_nan(self.started_s),
            finished_s=_or_nan(self.finished_s),
            picked_up=self.picked_up,
        )


class JobMemory(Spec):
    """Task that a robot does, as of `RobotJob`."""

    task: str
    why: str
    stop: int
    there_s: float | None
    dock: str


class RobotMemory(Spec):
    """A robot, as of `RobotRecord`."""

    name: str
    home: Point
    charge: float
    job: JobMemory | None
    totals: dict[str, float]

    @classmethod
    def of(cls, robot: RobotRecord) -> RobotMemory:
        """Return what is to be kept of a record."""
        job = robot.job
        kept = (
            None
            if job is None
            else JobMemory(task=job.record.id, why=job.why, stop=job.stop, there_s=_finite(job.there_s), dock=job.dock)
        )
        home = (robot.home.real, robot.home.imag)
        return cls(name=robot.name, home=home, charge=robot.charge, job=kept, totals=vars(robot.totals))

    def restore(self, robot: RobotRecord, tasks: Mapping[str, TaskRecord], docks: Mapping[str, complex]) -> None:
        """Have a robot go on with its task.

        Args:
            robot: Its record, which has no task.
            tasks: Tasks by id.
            docks: Places of docks by name.
        """
        robot.home, robot.charge, robot.totals = complex(*self.home), self.charge, RobotTotals(**self.totals)
        if self.job is None:
            return
        record, there_s = tasks[self.job.task], _or_nan(self.job.there_s)
        robot.job = RobotJob(record, self.job.why, self.job.stop, there_s, self.job.dock)
        robot.target = record.stops[self.job.stop].place if record.stops else docks.get(self.job.dock)


class DispatchMemory(Spec):
    """All tasks and robots of a dispatcher.

    Attributes:
        begun_s: Robots' clock when the team began.
        time_s: Time since then.
        tasks: In the order of their requests.
        robots: All robots.
    """

    begun_s: float
    time_s: float
    tasks: tuple[TaskMemory, ...]
    robots: tuple[RobotMemory, ...]


def remember(
    records: Iterable[TaskRecord], robots: Iterable[RobotRecord], begun_s: float, time_s: float
) -> DispatchMemory:
    """Return the memory of a dispatcher's records; times as of `DispatchMemory`."""
    return DispatchMemory(
        begun_s=begun_s,
        time_s=time_s,
        tasks=tuple(map(TaskMemory.of, records)),
        robots=tuple(map(RobotMemory.of, robots)),
    )


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value
