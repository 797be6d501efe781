"""Short sessions with everything in them, as recordings."""

from pathlib import Path

from touchline.checking.record_again import record_again
from touchline.checking.recorded_session import GivenJob, RecordedSession, TimedOrder
from touchline.schemas.faults import parse_fault
from touchline.schemas.messages import PlanOptions
from touchline.schemas.plan_cause import PlanCause
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.template import Template
from touchline.services.planner.plan import plan

BEND = Template(
    name="bend",
    segments=[
        {"id": "side", "line": {"start": (0.0, 0.0), "end": (0.7, 0.0)}},
        {"id": "bow", "arc": {"center": (0.7, 1.5), "start": (0.7, 0.0), "sweep_angle": 0.6}},
    ],
)
FAULT = parse_fault('{"kind": "corrections-lost", "start_s": 0.0, "duration_s": 1.0}')
ORDERS = (
    TimedOrder(0, "start", {}),
    TimedOrder(400, "inject-fault", {"fault": FAULT.model_dump(mode="json", exclude_none=True)}),
    TimedOrder(430, "pause", {}),
    TimedOrder(473, "resume", {}),
    TimedOrder(520, "abort", {"reason": "that is enough"}),
)
BRIEF = (TimedOrder(0, "start", {}), TimedOrder(110, "abort", {"reason": "that is enough"}))
"""The robot has set off, and paints nothing."""


def given(setup: Setup, orders: tuple[TimedOrder, ...] = ORDERS) -> RecordedSession:
    """A session with a pause, and a fault that an operator has injected; little is painted."""
    options = PlanOptions()
    job = GivenJob(plan(BEND, setup.vehicle, options).trajectory, BEND, PlanCause(options=options))
    load = TimedOrder(0, "load", {"taking": "carried"})
    return RecordedSession(setup, [load, *orders], [job], orders[-1].tick)


def record(path: Path, session: RecordedSession) -> Path:
    """Write what the robot says in a session."""
    record_again(path, session, "tt2")
    return path


def bend(path: Path, orders: tuple[TimedOrder, ...] = ORDERS, **scenario: object) -> Path:
    """A recording of the session."""
    return record(path, given(Setup(scenario=Scenario.model_validate({"seed": 3, **scenario})), orders))
