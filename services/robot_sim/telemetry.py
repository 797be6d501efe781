"""What the robot tells the world after a tick: the payloads of every topic that is due, in a fixed order.

Everything is stamped with sim time, so the same session gives the same bytes at any pace.
"""

from __future__ import annotations

from typing import Final

from schemas import messages as m
from schemas import topics
from schemas.cdr import encode
from schemas.digest import SessionDigest
from schemas.template import Template
from schemas.topics import Topic
from services.robot_sim import layouts
from services.robot_sim.emulator import Emulator
from services.robot_sim.frames import OnboardEvent, SensorFrame
from services.robot_sim.packing import NO_COVARIANCE_36, Payload, battery, gnss, header, odometry, stamp
from services.robot_sim.paint.ledger import Marks
from services.robot_sim.paint.metrics import SegmentMetrics
from services.robot_sim.world import body

_NO_COVARIANCE: Final = (0.0,) * 9
_NO_ORIENTATION: Final = (0.0, 0.0, 0.0, 1.0, -1.0, *(0.0,) * 8)


def _period(topic: Topic) -> int:
    """Ticks between two messages of a periodic topic."""
    return round(100 / topic.rate_hz)


_ODOMETRY_TICKS: Final = _period(topics.ODOMETRY)
_ESTIMATOR_TICKS: Final = _period(topics.ESTIMATOR)
_TRUTH_TICKS: Final = _period(topics.TRUTH)
_CLOCK_TICKS: Final = _period(topics.CLOCK)
_STATUS_TICKS: Final = _period(topics.STATUS)
_PAINT_TICKS: Final = _period(topics.PAINT)
_SPRAYER_TICKS: Final = _period(topics.SPRAYER)
_BATTERY_TICKS: Final = _period(topics.BATTERY)


class Telemetry:
    """Turns the emulator's state into payloads.

    Attributes:
        digest: The hash of what was told since the last load.
        final: The report that was told, once the traversal's watch has ended.
    """

    def __init__(self, emulator: Emulator) -> None:
        """Watch `emulator`; nothing has been told yet."""
        self._emulator = emulator
        noise = emulator.scenario.effective()
        gyro = (noise.imu.gyro_density_radps_rthz**2) * 100.0
        accel = (noise.imu.accel_density_mps2_rthz**2) * 100.0
        self._gyro_covariance = (gyro, 0.0, 0.0, 0.0, gyro, 0.0, 0.0, 0.0, gyro)
        self._accel_covariance = (accel, 0.0, 0.0, 0.0, accel, 0.0, 0.0, 0.0, accel)
        self._wheels = (0.0, 0.0)
        self._sprayer: tuple[float, ...] = ()
        self._state = -1
        self.digest = SessionDigest()
        self.final: m.TraversalReport | None = None

    def loaded(self, trajectory: m.Trajectory, template: Template | None) -> list[Payload]:
        """What is told once when a trajectory has been loaded; a new session begins."""
        self.digest, self.final = SessionDigest(), None
        told = [
            (topics.PLAN, encode(trajectory)),
            (topics.TEMPLATE, encode(m.String(data=template.model_dump_json() if template is not None else ""))),
        ]
        self.digest.add(told)
        return told + self.news()

    def after_tick(self) -> list[Payload]:
        """What is due after the emulator's last tick."""
        emulator = self._emulator
        tick, frame = emulator.tick_count, emulator.frame
        if frame is None:
            return []
        sec, nanosec = time = stamp(tick)
        command = emulator.command
        due = self._samples(tick, frame)
        due.append(
            (topics.WHEEL_COMMAND, layouts.WHEEL_COMMAND.pack(sec, nanosec, command.left_radps, command.right_radps))
        )
        for report in emulator.sensors.gnss_reports:
            due += gnss(report)
        if tick % _ODOMETRY_TICKS == 0:
            due.append((topics.ODOMETRY, self._estimate(time)))
        if tick % _ESTIMATOR_TICKS == 0:
            due.append((topics.ESTIMATOR, layouts.ESTIMATOR.pack(*time, *emulator.onboard.consistency)))
        if tick % _TRUTH_TICKS == 0:
            due.append((topics.TRUTH, self._truth(time)))
        due += self._sprayer_if_due(tick, time)
        if tick % _PAINT_TICKS == 0:
            due += self._paint(time)
        if tick % _BATTERY_TICKS == 0:
            due.append((topics.BATTERY, battery(time, emulator)))
        due += self._events()
        if tick % _STATUS_TICKS == 0 or emulator.onboard.state != self._state:
            due.append(self.status())
        if emulator.settled:
            due += self._paint(time)
        if tick % _CLOCK_TICKS == 0:
            due.append((topics.CLOCK, layouts.CLOCK.pack(sec, nanosec)))
        self.digest.add(due)
        if emulator.settled:
            due.append((topics.REPORT, encode(self._final_report())))
        return due

    def _final_report(self) -> m.TraversalReport:
        """The report with the hash of all that was told in the session, itself included."""
        report = self.report()
        self.digest.add([(topics.REPORT, encode(report))])
        self.final = report.model_copy(update={"session_hash": self.digest.hexdigest()})
        return self.final

    def news(self) -> list[Payload]:
        """What a command has changed: events and the status."""
        told = [*self._events(), self.status()]
        self.digest.add(told)
        return told

    def tell(self, event: OnboardEvent) -> Payload:
        """Something the operator should know, from outside the onboard computer."""
        told = _event(event, self._emulator.tick_count)
        self.digest.add([told])
        return told

    def status(self) -> Payload:
        """Where the traversal stands; not entered in the digest."""
        emulator, status, ledger = self._emulator, self._emulator.onboard.status, self._emulator.ledger
        self._state = status.state
        layout = layouts.status(status.reason, status.segment_id, ledger.ids)
        return topics.STATUS, layout.pack(
            *stamp(emulator.tick_count),
            status.state,
            status.segment_index,
            status.segment_count,
            status.arc_length_m,
            status.total_length_m,
            ledger.coverage_pct,
            *ledger.fractions,
            emulator.onboard.estimate.speed_mps,
            status.elapsed_s,
            status.remaining_s,
            ledger.lateral_m,
            self._spraying,
        )

    def report(self) -> m.TraversalReport:
        """The figures of the traversal; takes a moment."""
        emulator = self._emulator
        metrics, status, error = emulator.metrics(), emulator.onboard.status, emulator.estimator_error
        return m.TraversalReport(
            header=header(emulator.tick_count),
            success=status.state == m.TraversalStatus.DONE,
            total_time_s=status.elapsed_s,
            coverage_pct=metrics.coverage_pct,
            gap_m=metrics.gap_m,
            overspray_m2=metrics.overspray_m2,
            double_paint_m2=metrics.double_paint_m2,
            lateral_error_mean_m=metrics.lateral.mean_m,
            lateral_error_p95_m=metrics.lateral.p95_m,
            lateral_error_max_m=metrics.lateral.max_m,
            position_rmse_m=error.position_rmse_m,
            heading_rmse_rad=error.heading_rmse_rad,
            painted_length_m=metrics.painted_length_m,
            template_length_m=metrics.template_length_m,
            follower_fallbacks=status.follower_fallbacks,
            segments=tuple(_segment(segment) for segment in metrics.segments),
        )

    def strokes(self) -> m.GetPaintResponse:
        """Everything painted in this traversal."""
        head = header(self._emulator.tick_count)
        return m.GetPaintResponse(
            strokes=tuple(
                m.PaintMarks(
                    header=head,
                    segment_id=self._line(marks),
                    first_index=marks.first_index,
                    width_m=marks.width_m,
                    x_m=marks.x_m,
                    y_m=marks.y_m,
                )
                for marks in self._emulator.ledger.all_marks()
            )
        )

    def _events(self) -> list[Payload]:
        return [_event(event, self._emulator.tick_count) for event in self._emulator.take_events()]

    @property
    def _spraying(self) -> bool:
        return bool(self._emulator.world.state[body.FLOW_LPS] > 0.0)

    def _samples(self, tick: int, frame: SensorFrame) -> list[Payload]:
        """The samples of the 100 Hz sensors that arrived, stamped with the time of measurement."""
        due: list[Payload] = []
        imu_arrived, mag_arrived, encoder_arrived = self._emulator.sensors.arrived.tolist()
        if imu_arrived:
            imu = frame.imu
            payload = layouts.IMU.pack(
                *stamp(tick - frame.imu_age_ticks),
                *_NO_ORIENTATION,
                *imu[:3],
                *self._gyro_covariance,
                *imu[3:],
                *self._accel_covariance,
            )
            due.append((topics.IMU, payload))
        if mag_arrived:
            time = stamp(tick - frame.mag_age_ticks)
            due.append((topics.MAGNETIC_FIELD, layouts.MAGNETIC_FIELD.pack(*time, *frame.mag, *_NO_COVARIANCE)))
        if encoder_arrived:
            left, right = frame.encoders
            time = stamp(tick - frame.encoder_age_ticks)
            rates = self._wheel_rates(left, right)
            due.append((topics.JOINT_STATES, layouts.JOINT_STATES.pack(*time, left, right, *rates)))
        return due

    def _wheel_rates(self, left_rad: float, right_rad: float) -> tuple[float, float]:
        """Wheel rates as a driver derives them: the difference of two readings."""
        before, self._wheels = self._wheels, (left_rad, right_rad)
        return (left_rad - before[0]) * 100.0, (right_rad - before[1]) * 100.0

    def _estimate(self, time: tuple[int, int]) -> bytes:
        east, north, heading, speed, yaw_rate, covariance = self._emulator.onboard.estimate
        xx, xy, xh, _, yy, yh, _, _, hh = covariance.tolist()
        pose_covariance = [0.0] * 36
        pose_covariance[0], pose_covariance[1], pose_covariance[5] = xx, xy, xh
        pose_covariance[6], pose_covariance[7], pose_covariance[11] = xy, yy, yh
        pose_covariance[30], pose_covariance[31], pose_covariance[35] = xh, yh, hh
        return odometry(time, (east, north, heading), pose_covariance, (speed, yaw_rate))

    def _truth(self, time: tuple[int, int]) -> bytes:
        speed, yaw_rate = self._emulator.world.state[body.SPEED : body.YAW_RATE + 1].tolist()
        return odometry(time, self._emulator.world.pose, NO_COVARIANCE_36, (speed, yaw_rate))

    def _sprayer_if_due(self, tick: int, time: tuple[int, int]) -> list[Payload]:
        emulator = self._emulator
        state = emulator.world.state[body.VALVE_OPEN : body.FLOW_LPS + 1].tolist()
        switches = (
            emulator.command.valve,
            state[0] > 0.0,
            emulator.command.disc,
            state[body.DISC_DOWN - body.VALVE_OPEN] > 0.0,
            state[body.FLOW_LPS - body.VALVE_OPEN],
        )
        if switches == self._sprayer and tick % _SPRAYER_TICKS:
            return []
        self._sprayer = switches
        return [(topics.SPRAYER, layouts.SPRAYER.pack(*time, *switches, state[body.TANK_L - body.VALVE_OPEN]))]

    def _line(self, marks: Marks) -> str:
        """Id of the line that marks belong to, "" for none."""
        return self._emulator.ledger.ids[marks.target] if marks.target >= 0 else ""

    def _paint(self, time: tuple[int, int]) -> list[Payload]:
        ledger = self._emulator.ledger
        return [
            (
                topics.PAINT,
                layouts.paint_marks(self._line(marks), len(marks.x_m)).pack(
                    *time, marks.first_index, marks.width_m, *marks.x_m.tolist(), *marks.y_m.tolist()
                ),
            )
            for marks in ledger.take_marks()
        ]


def _segment(segment: SegmentMetrics) -> m.SegmentPaint:
    return m.SegmentPaint(
        id=segment.id,
        length_m=segment.length_m,
        coverage_pct=segment.coverage_pct,
        gap_m=segment.gap_m,
        width_m=segment.width_m,
        overspray_m2=segment.areas.overspray_m2,
        double_paint_m2=segment.areas.double_paint_m2,
        lateral_error_mean_m=segment.lateral.mean_m,
        lateral_error_p95_m=segment.lateral.p95_m,
        lateral_error_max_m=segment.lateral.max_m,
    )


def _event(event: OnboardEvent, tick: int) -> Payload:
    message = m.Event(
        header=header(tick), severity=event.severity, source=topics.ROBOT_SIM, code=event.code, text=event.text
    )
    return topics.EVENTS, encode(message)
