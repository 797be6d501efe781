"""Orders as service requests, and their outcomes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from touchline.schemas import replay_steps, topics
from touchline.schemas.messages.base import Message
from touchline.schemas.messages.plan_messages import PlanOptions, PlanRequest, PoseGoal
from touchline.schemas.messages.service_messages import CommandRequest, GotoRequest, LoadRequest, SetSpeedRequest
from touchline.schemas.messages.turf_tank import Trajectory
from touchline.schemas.plain_text import plain
from touchline.schemas.topics import Service

SPEEDS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, -1.0)
"""Speed factors on offer; a negative one is as fast as possible."""

COMMANDS = {
    "start": ("Start", topics.START),
    "pause": ("Pause", topics.PAUSE),
    "resume": ("Resume", topics.RESUME),
    "abort": ("Abort", topics.ABORT),
    "estop": ("Emergency stop", topics.ESTOP),
    "reset": ("Reset", topics.RESET),
    "refill": ("Refill", topics.REFILL_TANK),
    "battery": ("Replace battery", topics.REPLACE_BATTERY),
    "wait_on": ("Wait on", topics.WAIT_ON),
    "go_round": ("Go round", topics.GO_ROUND),
    "leave_out": ("Leave out", topics.LEAVE_OUT),
}
"""Title and service of orders without arguments, by name."""

ANSWERS = frozenset(("wait_on", "go_round", "leave_out"))
"""Orders to a robot that waits before something."""

COMMAND_TIMEOUT_S = 3.0
PLAN_TIMEOUT_S = 120.0
REFRESH_TIMEOUT_S = 3.0
LOAD_TIMEOUT_S = 15.0
STOP_TIMEOUT_S = 1.0
STOP_ATTEMPTS = 3
"""Attempts of orders that bring the robot to rest."""
ESTOP_TIMEOUT_S = 0.4
WITHOUT_END = 0
"""Number of attempts that means: until the robot's status confirms the order."""


@dataclass(frozen=True)
class Order:
    """Order as a service request, sent up to `attempts` times with the same request id, which is harmless.

    An emergency stop is sent `WITHOUT_END`, until it is called off.
    """

    name: str
    title: str
    service: Service[Any, Any]
    request: Message
    timeout_s: float = COMMAND_TIMEOUT_S
    attempts: int = 1

    @property
    def request_id(self) -> str:
        """Request id of its repeats and its progress."""
        return str(getattr(self.request, "request_id", ""))


@dataclass(frozen=True)
class Tried:
    """Event: an order is being sent for the `number`-th time."""

    order: Order
    number: int


@dataclass(frozen=True)
class OrderOutcome:
    """Outcome of an order, or of one try of an emergency stop: the answer, or the reason why there is none."""

    order: Order
    response: Any = None
    failure: str = ""

    @property
    def ok(self) -> bool:
        """True if the order was executed."""
        return not self.failure and bool(self.response.success)

    @property
    def reason(self) -> str:
        """Reason of a failure, or the service's message."""
        return plain(self.failure or str(self.response.message))


def command(name: str, request_id: str) -> Order:
    """Create an order of `COMMANDS`; those that stop the robot are repeated, the emergency stop without end."""
    title, service = COMMANDS[name]
    request = CommandRequest(request_id=request_id)
    if name == "estop":
        return Order(name, title, service, request, ESTOP_TIMEOUT_S, WITHOUT_END)
    if name in ("pause", "abort"):
        return Order(name, title, service, request, STOP_TIMEOUT_S, STOP_ATTEMPTS)
    return Order(name, title, service, request)


def plan(template_json: str, vehicle_json: str, options: PlanOptions, request_id: str) -> Order:
    """Create an order to plan a template for a vehicle; "" is the planner's default."""
    request = PlanRequest(
        request_id=request_id, template_json=template_json, vehicle_json=vehicle_json, options=options
    )
    return Order("plan", "Plan", topics.PLAN_SERVICE, request, PLAN_TIMEOUT_S)


def load(trajectory: Trajectory, template_json: str, request_id: str, *, cause_json: str = "") -> Order:
    """Create an order to load a plan into the robot."""
    request = LoadRequest(
        request_id=request_id, trajectory=trajectory, template_json=template_json, cause_json=cause_json
    )
    return Order("load", "Load", topics.LOAD, request, LOAD_TIMEOUT_S)


def go_on(trajectory: Trajectory, template_json: str, request_id: str) -> Order:
    """Create an order to load the rest of an unfinished job, whose plan is in the robot's journal if none is given."""
    request = LoadRequest(request_id=request_id, trajectory=trajectory, template_json=template_json, resume=True)
    return Order("load", "Go on", topics.LOAD, request, LOAD_TIMEOUT_S)


def preview(request: PlanRequest) -> Order:
    """Create an order to preview a drive to a goal."""
    return Order("preview", "Preview", topics.PLAN_SERVICE, request, PLAN_TIMEOUT_S)


def refresh(request: PlanRequest) -> Order:
    """Create an order to update a preview from the robot's present position."""
    return Order("refresh", "Preview", topics.PLAN_SERVICE, request, REFRESH_TIMEOUT_S)


def drive(goal: PoseGoal, request_id: str) -> Order:
    """Create an order to drive to a goal: the robot plans from its position and sets off."""
    request = GotoRequest(request_id=request_id, goal=goal)
    return Order("drive", "Drive", topics.GOTO, request, PLAN_TIMEOUT_S)


def set_speed(factor: float, request_id: str) -> Order:
    """Create an order to set the speed factor of simulated time."""
    return Order("speed", "Speed", topics.SET_SPEED, SetSpeedRequest(request_id=request_id, factor=factor))


def next_speed(factor: float | None, steps: int) -> float:
    """Speed factor a number of steps faster (slower, if negative) than `factor`."""
    if factor is None:
        return SPEEDS[0] if steps < 0 else SPEEDS[1]
    return replay_steps.next_speed(SPEEDS, factor, steps)
