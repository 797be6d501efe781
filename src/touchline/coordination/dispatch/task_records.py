"""Records of tasks: each has a state and a reason at any time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

from touchline.schemas.task_requests import (
    ChargeRequest,
    DeliveryRequest,
    GoToPlaceRequest,
    PatrolRequest,
    Point,
    Request,
)


class TaskState(StrEnum):
    """State of a task, in the words of Open-RMF."""

    QUEUED = "queued"
    SELECTED = "selected"
    DISPATCHED = "dispatched"
    FAILED_TO_ASSIGN = "failed_to_assign"
    UNDERWAY = "underway"
    DELAYED = "delayed"
    BLOCKED = "blocked"
    COMPLETED = "completed"
    FAILED = "failed"
    CANCELED = "canceled"
    KILLED = "killed"


WAITING: Final = frozenset((TaskState.QUEUED, TaskState.SELECTED, TaskState.DISPATCHED, TaskState.FAILED_TO_ASSIGN))
"""States of tasks that no robot has begun."""
RUNNING: Final = frozenset((TaskState.UNDERWAY, TaskState.DELAYED, TaskState.BLOCKED))
ENDED: Final = frozenset((TaskState.COMPLETED, TaskState.FAILED, TaskState.CANCELED, TaskState.KILLED))


@dataclass(frozen=True)
class TaskStop:
    """Place of a task.

    Attributes:
        place: x + iy (m).
        stay_s: Time at it.
        doing: What the robot does there.
    """

    place: complex
    stay_s: float
    doing: str


@dataclass
class TaskRecord:
    """A task.

    Attributes:
        id: Its name.
        request: The request.
        stops: Its places in their order; none: it charges.
        queued_s: Time of the request.
        state: Its state.
        reason: Why it is in that state.
        robot: Robot that it is assigned to.
        started_s: Time at which the robot began to drive for it.
        finished_s: Time at which it ended.
        estimate_s: Time at which it is expected to be finished.
        picked_up: Whether a robot has its goods.
    """

    id: str
    request: Request
    stops: tuple[TaskStop, ...]
    queued_s: float
    state: TaskState = TaskState.QUEUED
    reason: str = "waits to be assigned"
    robot: str = ""
    started_s: float = math.nan
    finished_s: float = math.nan
    estimate_s: float = math.nan
    picked_up: bool = False

    def become(self, state: TaskState, reason: str, now_s: float = math.nan) -> None:
        """Change the state; a time ends the task then."""
        self.state, self.reason = state, reason
        if state in ENDED:
            self.finished_s, self.estimate_s = now_s, math.nan

    @property
    def deadline_s(self) -> float:
        """Time after which it is late; inf: never."""
        return math.inf if self.request.deadline_s is None else self.request.deadline_s

    @property
    def late_s(self) -> float:
        """Time by which it is late, or is expected to be."""
        ends_s = self.finished_s if math.isfinite(self.finished_s) else self.estimate_s
        return max(ends_s - self.deadline_s, 0.0) if math.isfinite(ends_s) else 0.0

    def figures(self) -> dict[str, Any]:
        """Return the task as a JSON object."""
        request = self.request
        return {
            "id": self.id,
            "category": request.category,
            "state": str(self.state),
            "reason": self.reason,
            "robot": self.robot,
            "priority": request.priority,
            "labels": list(request.labels),
            "queued_s": self.queued_s,
            "started_s": _number(self.started_s),
            "finished_s": _number(self.finished_s),
            "estimate_s": _number(self.estimate_s),
            "deadline_s": request.deadline_s,
            "late_s": round(self.late_s, 3),
        }


def stops_of(request: Request, places: list[Point]) -> tuple[TaskStop, ...]:
    """Return the stops of a request whose places are known (m)."""
    at = [complex(x, y) for x, y in places]
    match request:
        case GoToPlaceRequest():
            return (TaskStop(at[0], request.dwell_s, "stays at its place"),)
        case PatrolRequest():
            return tuple(TaskStop(each, request.dwell_s, "stays at a place") for each in at) * request.rounds
        case DeliveryRequest():
            return (TaskStop(at[0], request.pickup_s, "picks up"), TaskStop(at[1], request.dropoff_s, "drops off"))
        case ChargeRequest():
            return ()


def _number(value: float) -> float | None:
    return round(value, 3) if math.isfinite(value) else None
