"""Telemetry of the robot: the payloads of every topic that is due after a tick, in a fixed order.

Everything is stamped with sim time, so the same session gives the same bytes at any pace.
"""

from __future__ import annotations

import math
from functools import cached_property, partial
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.interface import TICKS_PER_S, MoveOffWarning, OnboardEvent, Status
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.digest import SessionDigest
from touchline.schemas.template import Template
from touchline.services.robot_sim import layouts, tick_log
from touchline.services.robot_sim.accounting.area_metrics import area_metrics
from touchline.services.robot_sim.contact_account import contact_report
from touchline.services.robot_sim.drive_log import DriveLog
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.packing import (
    Payload,
    Stamp,
    about_to_move,
    event_payload,
    gnss,
    header,
    job_payloads,
    obstacles,
    order_payload,
    paint_payloads,
    pause_status,
    plan_state,
    plan_state_at,
    positions,
    sensor_samples,
    stamp,
    status,
    true_coverage,
    whereabouts,
    whereabouts_at,
    zones,
)
from touchline.services.robot_sim.paint.smears import smearing
from touchline.services.robot_sim.samples import Placed, Samples, Series, battery_state, odometry_of, sprayer_state
from touchline.services.robot_sim.standing_twin import StandingTwin
from touchline.services.robot_sim.tick_log import WHEREABOUTS_TICKS, Rows, period
from touchline.services.robot_sim.traversal_figures import Figures, Reports
from touchline.services.robot_sim.world.world import held

_CLOCK_TICKS: Final = period(topics.CLOCK)
_STATUS_TICKS: Final = period(topics.STATUS)
_PAINT_TICKS: Final = period(topics.PAINT)
_OBSTACLE_TICKS: Final = period(topics.OBSTACLES)
_AREA_TICKS: Final = period(topics.AREA)
MOST_TICKS: Final = math.gcd(WHEREABOUTS_TICKS, _CLOCK_TICKS, _STATUS_TICKS, _PAINT_TICKS)
"""Largest number of ticks between two checks of the low-rate topics."""
_MOST_HELD: Final = 32 * MOST_TICKS
"""Largest number of ticks that can be published at once."""


class _Steady(NamedTuple):
    """State of a guided robot at the last check; in nominal ticks since then only its motion is new."""

    status: Status
    report: m.Whereabouts | m.PlanState


class Telemetry:
    """Packer of the emulator's state.

    Args:
        emulator: The robot.
        log: Log of the whole drive, if one is wanted.
        report_at_once: True to make the final report, which takes a moment, in the tick in which the traversal ends;
            otherwise the caller checks `ended`, has the report made and passes it to `conclude`.

    Attributes:
        digest: Hash of the messages since the last load.
        ended: Traversal that has ended and whose final report was not published yet.
        final: Published reports, once the observation of the traversal has ended.
    """

    def __init__(self, emulator: Emulator, *, report_at_once: bool = True, log: DriveLog | None = None) -> None:
        self._emulator, self._at_once, self._drive_log = emulator, report_at_once, log
        self.ended: Figures | None = None
        self._columns = tick_log.columns(len(emulator.vehicle.drive.actuators))
        self._log: Rows = np.zeros((_MOST_HELD, self._columns))
        self._held = 0
        self._positions: list[Placed] = []
        self._low_rate: list[Placed] = []
        self._state = -1
        self._warning: MoveOffWarning | None = None
        self._paused = False
        self._steady: _Steady | None = None
        self.digest = SessionDigest()
        self.final: Reports | None = None

    @cached_property
    def _samples(self) -> Samples:
        """Packer of samples, made when first used: a simulation that nobody records has none."""
        emulator = self._emulator
        return Samples(emulator.vehicle, emulator.scenario, emulator.sensors.transport.history, _MOST_HELD)

    def setup(self) -> Payload:
        """Return the setup of the robot and its world, published once at its start: not part of a session's hash."""
        return topics.SETUP, encode(m.String(data=self._emulator.setup.model_dump_json()))

    def loaded(self, trajectory: m.Trajectory, template: Template | None) -> list[Payload]:
        """Begin a session, as `begin`, with the payloads of a loaded trajectory and its template made here."""
        return self.begin(job_payloads(trajectory, template))

    def begin(self, payloads: list[Payload]) -> list[Payload]:
        """Begin a new session with the `job_payloads` of a loaded trajectory; return them with the state then."""
        self.digest, self.ended, self.final = SessionDigest(), None, None
        self.digest.add(payloads)
        initial = self._emulator.initial
        state = [] if initial is None else [(topics.INITIAL_STATE, encode(m.String(data=initial.text)))]
        return state + payloads + self.news()

    def go_on(self) -> None:
        """Continue from an emulator that has run before: what is true already is no news in the next tick."""
        if self._emulator.tick_count:
            row = np.zeros(self._columns)
            self._note(row)
            self._samples.published_before(row)

    def awake(self) -> list[Payload]:
        """Return the state of the standing robot while sim time is held: tank, battery, fix and pose, if known.

        Published when its process begins, and before each job that it is given; nothing while it moves. Not entered in
        the digest: a session is the same whether or not anybody looks at the robot before it.
        """
        if self._emulator.active:
            return []
        emulator, row = self._emulator, np.zeros(self._columns)
        self._note(row)
        payloads = self._levels(row)
        if emulator.onboard.aligned:
            return [*payloads, (topics.ODOMETRY, odometry_of(row))]
        twin = StandingTwin(emulator)
        if twin.gnss is not None and not emulator.tick_count:  # later its receiver has reported itself
            time_s = emulator.time_s
            payloads += [each for each in gnss(twin.gnss._replace(stamp_s=time_s)) if each[0] is topics.GNSS_STATUS]
        if twin.emulator.onboard.aligned:
            Telemetry(twin.emulator)._note(row)
            row[tick_log.TICK] = emulator.tick_count
            payloads.append((topics.ODOMETRY, odometry_of(row)))
        return payloads

    def after_tick(self) -> list[Payload]:
        """Return the payloads that are due after the emulator's last tick."""
        return self.after(1)

    def after(self, count: int) -> list[Payload]:
        """Return the payloads that are due after the emulator's last `count` ticks; see `hold`."""
        self.hold(count)
        return self.told()

    @property
    def rows(self) -> Rows:
        """Rows (at least MOST_TICKS, tick_log.columns) for the log of the nominal ones among the next ticks."""
        return self._log[self._held :]

    @property
    def full(self) -> bool:
        """True if the held payloads have to be taken before the next ticks."""
        return self._held + MOST_TICKS > len(self._log)

    def hold(self, count: int) -> None:
        """Hold the payloads of the emulator's last `count` ticks, at most those of `until_due`, until they are taken.

        All but the last of them were nominal and are in `rows`; so is that one, if it was. Nothing else may be
        published before the held payloads.
        """
        emulator = self._emulator
        tick = emulator.tick_count
        time = stamp(tick)
        first, self._held = self._held, self._held + count
        last = self._held - 1
        row = self._log[last]
        if self._steady is not None and (
            due_before := range(first + (last - tick - first) % MOST_TICKS, last, MOST_TICKS)
        ):
            self._hold_steady(self._steady, due_before)
        if row[tick_log.TICK] != tick:
            self._note(row)
            sensors = emulator.sensors
            self._positions += [(last, payload) for payload in positions(sensors)]
            reported = sensors.transport.arrivals[0] if sensors.gnss_reports or sensors.camera_poses else None
        else:
            reported = None
        if self._drive_log is not None:
            self._drive_log.take(self._log[first : self._held], reported)
        due = sensor_samples(emulator.samples, emulator.auxiliary.specs)
        if tick % WHEREABOUTS_TICKS == 0 and (message := emulator.onboard.whereabouts) is not None:
            due.append((topics.WHEREABOUTS, whereabouts(time, message)))
        if tick % WHEREABOUTS_TICKS == 0 and (planned := emulator.onboard.plan_state) is not None:
            due.append((topics.PLAN_STATE, plan_state(time, planned)))
        if tick % _OBSTACLE_TICKS == 0 and (perception := emulator.onboard.perception) is not None:
            due.append(obstacles(tick, perception))
            if (around := emulator.onboard.protection.zones) is not None:
                due += zones(tick, around)
        if tick % _PAINT_TICKS == 0:
            due += self._paint(time)
        due += [*self._orders(), *self._events(), *self._warnings(), *self._way_round()]
        if tick % _STATUS_TICKS == 0 or emulator.onboard.state != self._state:
            flowing = bool(row[tick_log.FLOW_LPS] > 0.0)
            due += self._stands(time, emulator.onboard.status, float(row[tick_log.SPEED]), flowing=flowing)
        if emulator.settled:
            due += self._paint(time)
        if tick % _AREA_TICKS == 0 or emulator.settled:
            due += self._area(time)
        if tick % _CLOCK_TICKS == 0:
            due.append((topics.CLOCK, layouts.CLOCK.pack(*time)))
        self._low_rate += [(last, payload) for payload in due]

    def _hold_steady(self, steady: _Steady, rows: range) -> None:
        """Hold the payloads of nominal ticks of a guided robot, which are in these rows of the log, one or more."""
        report = steady.report
        orders = self._orders()  # commands come between stretches
        for at, row in zip(rows, self._log[rows.start : rows.stop : rows.step].tolist(), strict=True):
            tick = round(row[tick_log.TICK])
            time = stamp(tick)
            there: Payload
            if isinstance(report, m.PlanState):
                motion = row[tick_log.ESTIMATE : tick_log.ESTIMATE + 5]
                there = topics.PLAN_STATE, plan_state_at(time, report, tick / TICKS_PER_S, motion)
            else:
                place = *row[tick_log.ESTIMATE : tick_log.ESTIMATE + 2], *row[tick_log.STOP : tick_log.STOP + 2]
                there = topics.WHEREABOUTS, whereabouts_at(time, report, tick / TICKS_PER_S, place)
            status_then = steady.status._replace(elapsed_s=row[tick_log.ELAPSED_S])
            payloads = self._stands(time, status_then, row[tick_log.SPEED], flowing=row[tick_log.FLOW_LPS] > 0.0)
            clock = topics.CLOCK, layouts.CLOCK.pack(*time)
            self._low_rate += [(at, each) for each in (there, *orders, *payloads, clock)]
            orders = []

    def told(self) -> list[Payload]:
        """Return and release the held payloads, tick by tick; with the reports, if the traversal has ended."""
        by_tick: list[list[Payload]] = [[] for _ in range(self._held)]
        for topic, rows, payloads in self._enter_held():
            for row, payload in zip(rows, payloads.each(), strict=True):
                by_tick[row].append((topic, payload))
        for row, low_rate in self._low_rate:
            by_tick[row].append(low_rate)
        return [payload for due in by_tick for payload in due] + self._let_go()

    def only_hashed(self) -> None:
        """Release the held payloads after adding them to the hash."""
        self._enter_held()
        self._let_go()

    def _enter_held(self) -> list[Series]:
        """Add the held payloads to the digest; return their series of samples."""
        series = self._samples.series(self._log[: self._held], self._positions) if self._held else []
        for topic, _, payloads in series:
            self.digest.add_of(topic, *payloads)
        self.digest.add(payload for _, payload in self._low_rate)
        return series

    def _let_go(self) -> list[Payload]:
        """Release the held payloads; return the reports that follow them, if the traversal has ended with them."""
        held, self._held, self._positions, self._low_rate = self._held, 0, [], []
        if not held or not self._emulator.settled:
            return []
        self.ended = self._figures()
        return self.conclude(self.ended.final_reports()) if self._at_once else []

    def conclude(self, reports: Reports) -> list[Payload]:
        """Take the final reports of the traversal that has `ended`."""
        self.ended, self.final = None, reports
        return reports.payloads()

    def until_due(self, most: int) -> int:
        """Return the number of ticks (at most `most`) after which `hold` has to be called at the latest.

        That is when the next low-rate message is due, but for a guided robot all that is new in these until something
        happens is in the log.
        """
        emulator = self._emulator
        self._steady, onboard = None, emulator.onboard
        nothing_new = emulator.faults.no_events and not emulator.work.ledger.points
        if nothing_new and onboard.steady:
            report = onboard.whereabouts or onboard.plan_state
            assert report is not None, "it is guided"
            self._steady = _Steady(onboard.status, report)
            return min(most, len(self._log) - self._held)
        return min(most, MOST_TICKS - emulator.tick_count % MOST_TICKS)

    def _note(self, row: NDArray[np.float64]) -> None:
        """Log the emulator's last tick."""
        emulator = self._emulator
        command, sensors, tick = emulator.command, emulator.sensors, emulator.tick_count
        transport = sensors.transport
        tick_log.note(row, tick, emulator.world.state.array, transport.readings, held(command))
        row[tick_log.MEASURED : tick_log.ESTIMATE] = np.where(transport.arrived, transport.measured_tick, -1)
        *estimate, covariance, twist_covariance = emulator.onboard.estimate
        row[tick_log.ESTIMATE : tick_log.COVARIANCE] = estimate
        row[tick_log.COVARIANCE : tick_log.TWIST_COVARIANCE] = covariance
        row[tick_log.TWIST_COVARIANCE : tick_log.TRUTH] = twist_covariance
        if tick % tick_log.ESTIMATOR_TICKS == 0:
            row[tick_log.CONSISTENCY : tick_log.ELAPSED_S] = emulator.onboard.consistency
        if self._drive_log is not None:
            row[tick_log.PROGRESS : tick_log.FIXES] = emulator.onboard.progress

    def news(self) -> list[Payload]:
        """Return the changes made by a command: events, the status and the truth beside it."""
        payloads = [*self._orders(), *self._events(), *self._warnings(), *self._way_round(), *self.standing()]
        self.digest.add(payloads)
        return payloads

    def supplies(self) -> list[Payload]:
        """Return tank and battery, at once after one of them was filled: sim time may stand still."""
        row = np.zeros(self._columns)
        self._note(row)
        payloads = self._levels(row)
        self.digest.add(payloads)
        return payloads

    def _levels(self, row: NDArray[np.float64]) -> list[Payload]:
        """Return tank, if there is one, and battery."""
        vehicle = self._emulator.vehicle
        tank = [(topics.SPRAYER, sprayer_state(row))] if vehicle.tool.paints else []
        return [*tank, (topics.BATTERY, battery_state(row, vehicle.body.battery_wh))]

    def report_event(self, event: OnboardEvent) -> Payload:
        """Return an event for the operator from outside the onboard computer."""
        payload = event_payload(event, self._emulator.tick_count)
        self.digest.add([payload])
        return payload

    def standing(self) -> list[Payload]:
        """Return the status of the traversal, as estimated and in truth; not entered in the digest."""
        emulator = self._emulator
        onboard, flowing = emulator.onboard, emulator.world.state.flow_lps > 0.0
        return self._stands(stamp(emulator.tick_count), onboard.status, onboard.estimate.speed_mps, flowing=flowing)

    def _stands(self, time: Stamp, current: Status, speed_mps: float, *, flowing: bool) -> list[Payload]:
        self._state = current.state
        payload = status(time, current, speed_mps, self._emulator.onboard)
        return [*self._pauses(current), payload, true_coverage(time, self._emulator, flowing=flowing)]

    def _pauses(self, current: Status) -> list[Payload]:
        """Return the status of a pause, or of its end; nothing if there was none."""
        paused_before, self._paused = self._paused, current.pause is not None
        return [pause_status(self._emulator.tick_count, current.pause)] if paused_before or self._paused else []

    def _warnings(self) -> list[Payload]:
        """Return the warning before the robot moves off, if it begins or ends."""
        warning = self._emulator.onboard.warning
        if warning == self._warning:
            return []
        self._warning = warning
        return [about_to_move(self._emulator.tick_count, warning)]

    def _way_round(self) -> list[Payload]:
        """Return the report about things in the way, if there is a new one."""
        said = self._emulator.take_way_round()
        if said is None:
            return []
        return [(topics.WAY_ROUND, encode(said.model_copy(update={"header": header(self._emulator.tick_count)})))]

    def _area(self, time: Stamp) -> list[Payload]:
        account = self._emulator.work.account
        if account is None:
            return []
        account.take(self._emulator.work.ledger)
        return [(topics.AREA, layouts.AREA.pack(*time, *account.standing))]

    def reports(self) -> Reports:
        """Compute the reports of the traversal so far; takes a moment."""
        return self._figures().reports()

    def _figures(self) -> Figures:
        emulator, work = self._emulator, self._emulator.work
        error, ledger, track = work.estimator_error, work.ledger.snapshot(), work.track.snapshot()
        return Figures(
            emulator.tick_count,
            emulator.onboard.status,
            (error.position_rmse_m, error.heading_rmse_rad),
            ledger,
            partial(smearing, ledger, track, emulator.real),
            partial(area_metrics, work.account, ledger, track) if work.account is not None else None,
            contact_report(header(emulator.tick_count), work.contacts),
            self.digest.copy(),
        )

    def strokes(self) -> tuple[m.PaintMarks, ...]:
        """Return all paint of this traversal."""
        return tuple(decode(m.PaintMarks, payload) for _, payload in self.all_paint())

    def restored_paint(self) -> list[Payload]:
        """Return the paint of an earlier process, once a job has been loaded that continues from there."""
        payloads = self._paint(stamp(self._emulator.tick_count))
        self.digest.add(payloads)
        return payloads

    def all_paint(self) -> list[Payload]:
        """Return all paint of this traversal again; not entered in the digest."""
        ledger = self._emulator.work.ledger
        return paint_payloads(ledger, ledger.all_marks(), stamp(self._emulator.tick_count))

    def _events(self) -> list[Payload]:
        events = self._emulator.take_events()
        if self._drive_log is not None:
            self._drive_log.take_events(events, self._emulator.tick_count)
        return [event_payload(event, self._emulator.tick_count) for event in events]

    def _orders(self) -> list[Payload]:
        return [order_payload(order) for order in self._emulator.orders.take()]

    def _paint(self, time: Stamp) -> list[Payload]:
        return paint_payloads(self._emulator.work.ledger, self._emulator.work.ledger.take_marks(), time)
