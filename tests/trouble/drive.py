"""Drives a case in one process, and tells its properties of every look at the robot."""

import hashlib
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final, NamedTuple

from tests.robot_sim.scripted import trajectory
from tests.trouble.case import Case, Order
from touchline.jobs.recording.payload_recorder import PayloadRecorder
from touchline.onboard.interface import OnboardEvent
from touchline.schemas.curves import Curve
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import PaintMarks, Trajectory, TraversalReport, TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import UNLOGGED, FastRunner
from touchline.services.robot_sim.loaded_job import Taking
from touchline.services.robot_sim.packing import Payload
from touchline.services.robot_sim.recovery_state import EarlierWork
from touchline.services.robot_sim.telemetry import Telemetry

PAUSED, ESTOPPED = TraversalStatus.PAUSED, TraversalStatus.ESTOPPED
LOOK_TICKS: Final = 10
"""Ticks between two looks, while nothing has to be decided."""
PATIENCE_TICKS: Final = 300
"""Time after which a patient operator does something about a robot that stands."""
AHEAD_M: Final = 1.0
"""Way of the order `goto`."""


class Refused(NamedTuple):
    """Order that the robot did not carry out, and its reason."""

    order: Order
    why: str


class Look(NamedTuple):
    """State of a drive after some ticks.

    Attributes:
        emulator: The robot; another one after a kill.
        before: State of the traversal before these ticks and after the orders.
        ticks: Number of the ticks.
        heard: Events of these ticks.
        given: Names of the orders given just before them.
    """

    emulator: Emulator
    before: int
    ticks: int
    heard: tuple[OnboardEvent, ...]
    given: tuple[str, ...]


class Driven(NamedTuple):
    """A case that has been driven to its end.

    Attributes:
        case: The case.
        emulator: The robot at the end.
        report: Report of the template's job.
        strokes: Its true paint.
        believed_pct: Share of the lines that the robot believes to have painted.
        state: State in which that job ended.
        orders: All orders, those of a patient operator included.
        refused: Those that the robot refused.
        session_hash: Hash of everything published; "" if nobody listened.
        heard: All events.
    """

    case: Case
    emulator: Emulator
    report: TraversalReport
    strokes: tuple[PaintMarks, ...]
    believed_pct: float
    state: int
    orders: tuple[Order, ...]
    refused: tuple[Refused, ...]
    session_hash: str
    heard: tuple[OnboardEvent, ...]


class _Overheard(Emulator):
    """A robot whose events are noted as they are taken."""

    def __init__(self, case: Case) -> None:
        super().__init__(VEHICLE, case.scenario, OnboardConfig(follower=case.follower))
        self.heard: list[OnboardEvent] = []

    def take_events(self) -> list[OnboardEvent]:
        taken = super().take_events()
        self.heard += taken
        return taken


VEHICLE: Final = Vehicle()


class CaseDrive:
    """A drive of a case.

    Args:
        case: The case.
        listened: Whether everything is packed and hashed.
        record: File to record it to, which needs `listened`.
        look_ticks: Most ticks from one look to the next.
        orders: Orders instead of the case's and those of its operator.
    """

    def __init__(
        self,
        case: Case,
        *,
        listened: bool = False,
        record: Path | None = None,
        look_ticks: int = LOOK_TICKS,
        orders: tuple[Order, ...] | None = None,
    ) -> None:
        self._case, self._listened, self._look_ticks = case, listened or record is not None, look_ticks
        self._ahead = list(case.orders if orders is None else orders)
        self._patient = case.patient and orders is None
        self._given: list[Order] = []
        self._refused: list[Refused] = []
        self._heard: list[OnboardEvent] = []
        self._job: dict[str, Any] | None = None
        self._plan: Trajectory = plan(case.template, VEHICLE).trajectory
        self._record, self._digest = record, hashlib.sha256()

    def run(self, properties: "Iterable[Any]" = ()) -> Driven:
        """Drive to the end, or until a patient operator gives up; each property sees every look."""
        watching = tuple(properties)
        with ExitStack() as stack:
            self._recorder = stack.enter_context(PayloadRecorder(self._record))
            self._switch_on()
            limit = 2 * round(100 * self._load()) + 12000
            if self._listened:
                self._tell(self._telemetry.news())
            while self._goes_on(limit):
                look = self._step(limit)
                for each in watching:
                    each.look(look)
            self._note_job()
            self._hear()
        assert self._job is not None
        return Driven(
            case=self._case, emulator=self._emulator, orders=tuple(self._given), refused=tuple(self._refused),
            heard=tuple(self._heard), session_hash=self._digest.hexdigest() if self._listened else "", **self._job,
        )  # fmt: skip

    def _goes_on(self, limit: int) -> bool:
        emulator = self._emulator
        waits = emulator.onboard.state == ESTOPPED and self._patient
        return emulator.tick_count < limit and bool(emulator.active or self._ahead or waits)

    def _step(self, limit: int) -> Look:
        """Give the orders that are due, and run some ticks."""
        given = []
        while self._due:
            given.append(self._order(self._ahead.pop(0)))
        if order := self._help():
            given.append(self._order(order))
        emulator, first, heard = self._emulator, self._emulator.tick_count, len(self._heard)
        before = emulator.onboard.state
        next_order = self._ahead[0].tick if self._ahead else limit
        self._ticks(min(self._look_ticks, max(next_order - first, 1)))
        return Look(emulator, before, emulator.tick_count - first, tuple(self._heard[heard:]), tuple(given))

    @property
    def _due(self) -> bool:
        """Return whether the next order is to be given: one that comes after the end of the job, at once."""
        emulator = self._emulator
        over = not emulator.active and emulator.onboard.state != ESTOPPED
        return bool(self._ahead) and (over or self._ahead[0].tick <= emulator.tick_count)

    def _ticks(self, most: int) -> None:
        if self._listened:
            telemetry = self._telemetry
            telemetry.hold(self._runner.step(telemetry.until_due(most), telemetry.rows))
            self._tell(telemetry.told())
        else:
            self._runner.step(most, UNLOGGED)
            self._emulator.take_events()
        self._hear()
        if self._emulator.settled:
            self._note_job()
        if self._emulator.onboard.state not in (PAUSED, ESTOPPED):
            self._stands_since = 0
        elif not self._stands_since:
            self._stands_since = self._emulator.tick_count

    def _tell(self, payloads: Sequence[Payload]) -> None:
        for topic, payload in payloads:
            self._digest.update(topic.name.encode() + payload)
        self._recorder.hear("", payloads)

    def _hear(self) -> None:
        self._heard += self._emulator.heard
        self._emulator.heard.clear()

    def _help(self) -> Order | None:
        """Return the order that a patient operator gives now to a robot that stands."""
        emulator, tick = self._emulator, self._emulator.tick_count
        status = emulator.onboard.status
        if not self._patient or not self._stands_since or tick - self._stands_since < PATIENCE_TICKS:
            return None
        self._stands_since = tick
        if status.state == ESTOPPED:
            return Order(tick=tick, name="reset")
        if status.pause is not None and status.pause.ends_by_itself:
            return None
        return Order(tick=tick, name="refill_tank" if self._thirsty() else "resume")

    def _thirsty(self) -> bool:
        return self._emulator.world.supplies[0] < 1.0

    def _order(self, order: Order) -> str:
        """Carry out an order; one that is refused is noted."""
        order = order.model_copy(update={"tick": self._emulator.tick_count})
        self._given.append(order)
        try:
            self._carry_out(order.name)
        except CommandRefused as refusal:
            self._refused.append(Refused(order, str(refusal)))
            return order.name
        if self._listened:
            refilled = order.name == "refill_tank"
            self._tell(self._telemetry.supplies() if refilled else self._telemetry.news())
        return order.name

    def _carry_out(self, name: str) -> None:
        if name == "kill":
            self._kill()
        elif name == "goto":
            self._go_ahead()
        elif name == "fail_safe":
            self._emulator.fail_safe(1.0)
        else:
            getattr(self._emulator, name)()

    def _switch_on(self) -> None:
        self._emulator = _Overheard(self._case)
        self._runner, self._telemetry = FastRunner(self._emulator), Telemetry(self._emulator)
        self._stands_since = 0
        if self._listened:
            telemetry = self._telemetry
            telemetry.go_on()
            self._tell([telemetry.setup(), *telemetry.standing(), *telemetry.awake()])

    def _load(self, **how: Any) -> float:
        telemetry = self._telemetry
        duration_s = self._emulator.load(self._plan, self._case.template, **how)
        if self._listened:
            self._tell(telemetry.awake() + telemetry.loaded(self._plan, self._case.template))
            self._tell(telemetry.restored_paint() if how else [])
        self._emulator.start()
        return duration_s

    def _kill(self) -> None:
        """End the process without warning; the next one continues the job from what is in the journal."""
        emulator = self._emulator
        checkpoint = emulator.onboard.checkpoint
        stopped = emulator.onboard.state == ESTOPPED  # which its journal keeps, and so does not end in motion
        if checkpoint is None or stopped or self._job is not None:
            raise CommandRefused("there is no job to be continued at once")
        earlier = EarlierWork(emulator.totals, emulator.work.ledger.rows(0).copy())
        self._hear()
        self._switch_on()
        self._load(resume=checkpoint, earlier=earlier)

    def _go_ahead(self) -> None:
        """Drive straight on from where the robot stands, as another job."""
        pose, emulator = self._emulator.onboard.estimate, self._emulator
        ahead = trajectory([Curve(*pose[:3], 0.0, AHEAD_M)], [0], speed_mps=0.25)
        emulator.check_load()
        prepared = emulator.prepare(ahead, taking=Taking.HERE)
        self._note_job()
        emulator.take(prepared)
        if self._listened:
            self._tell(self._telemetry.awake() + self._telemetry.loaded(ahead, None))
        emulator.start()

    def _note_job(self) -> None:
        """Keep what there is to say about the template's job, once."""
        if self._job is not None:
            return
        onboard = self._emulator.onboard
        report = self._telemetry.final or self._telemetry.reports()
        self._job = {
            "report": report.traversal,
            "strokes": self._telemetry.strokes(),
            "believed_pct": onboard.painted.coverage_pct,
            "state": onboard.state,
        }
