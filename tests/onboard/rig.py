"""A small robot of its own to test the onboard computer with: independent of the emulated world and its sensors.

A differential drive with first-order wheels is integrated exactly along its arc once per tick; every sensor error
comes from one seeded generator. Faults are plain attributes that a test sets.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from tests.two_wheels import STANDSTILL
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.onboard import Onboard
from touchline.onboard.interface import (
    TICK_S,
    Command,
    GnssSample,
    ImuSample,
    MagSample,
    SensorFrame,
)
from touchline.schemas.curves import Curve
from touchline.schemas.messages import (
    Actuation,
    LinearDirection,
    PathVelocityParameter,
    Segment,
    Trajectory,
    VelocityType,
)
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.trajectories import assemble, segment, turn, velocity
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.paint.targets import start_pose

FIELD_T = 1.7e-5


@cache
def fading(sigma: float, tau_s: float, period_s: float = TICK_S) -> tuple[float, float]:
    """Share of itself that a Gauss-Markov error of that deviation keeps in a period, and the new part's deviation."""
    keep = math.exp(-period_s / tau_s)
    return keep, sigma * math.sqrt(1.0 - keep * keep)


@dataclass
class Rig:
    """The true robot and its sensors; `scenario.effective()` decides the noise."""

    vehicle: Vehicle = field(default_factory=Vehicle)
    scenario: Scenario = field(default_factory=lambda: Scenario(noise="none"))
    seed: int = 0
    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0
    fix: int = 3
    fix_offset_m: tuple[float, float] = (0.0, 0.0)
    correction_age_s: float = 0.0
    silent: bool = False  # no fixes at all
    crab_mps: float = 0.0  # sideways drift while moving
    blocked: int = -1  # wheel that is held fast
    spin_share: float = 0.0  # of the ground speed that both wheels lose
    valve_stuck: bool | None = None  # where it is, whatever is commanded
    bumper: bool = False
    battery: float = 1.0
    tank_l: float = 20.0
    operator: bool = True

    def __post_init__(self) -> None:
        noise = self.scenario.effective()
        rng = self.rng = np.random.default_rng(self.seed)
        self.noise = noise
        self.tick = 0
        self.wheels = [0.0, 0.0]
        self.angles = [0.0, 0.0]
        self.speed = self.yaw_rate = 0.0
        # Numbers, not arrays: they are faster, and there is a tick for every hundredth of a second.
        self.slip: list[float] = rng.normal(0.0, noise.drive.slip_relative, 2).tolist()
        off = rng.normal(0.0, noise.drive.wheel_radius_relative, 2)
        self.radius: list[float] = (self.vehicle.drive.wheel_radius_m * (1.0 + off)).tolist()
        self.gyro_bias = rng.normal(0.0, noise.imu.gyro_turn_on_bias_radps)
        self.accel_bias = rng.normal(0.0, noise.imu.accel_turn_on_bias_mps2)
        self.mag_bias = rng.normal(0.0, noise.magnetometer.bias_rad)
        self.mag_wander = rng.normal(0.0, noise.magnetometer.disturbance_rad)
        gnss = noise.gnss
        self.slow = np.array([rng.normal(0.0, gnss.gauss_markov_1_m, 2), rng.normal(0.0, gnss.gauss_markov_2_m, 2)])
        self.in_flight: deque[tuple[int, GnssSample]] = deque()

    def step(self, command: Command = STANDSTILL) -> SensorFrame:
        """Let a tick pass under `command`; what the sensors say at its end."""
        self.tick += 1
        self._move(command)
        fix = self._gnss()
        if command.valve if self.valve_stuck is None else self.valve_stuck:
            self.tank_l = max(
                self.tank_l - self.vehicle.tool.paint_l_per_m * self.vehicle.tool.paint_speed_mps * TICK_S, 0.0
            )
        return SensorFrame(
            self.tick,
            self.tick * TICK_S,
            self._imu(),
            self._mag(),
            tuple(self.angles),
            (fix,) if fix else (),
            bumper=self.bumper,
            battery_fraction=self.battery,
            tank_l=self.tank_l,
            operator_alive=self.operator,
        )

    def nozzle(self) -> tuple[float, float]:
        nx, ny = self.vehicle.tool.nozzle_x_m, self.vehicle.tool.nozzle_y_m
        c, s = math.cos(self.heading), math.sin(self.heading)
        return self.x + c * nx - s * ny, self.y + s * nx + c * ny

    def _move(self, command: Command) -> None:
        v, noise = self.vehicle, self.noise
        keep, fresh = fading(noise.drive.slip_relative, noise.drive.slip_tau_s)
        self.slip = [keep * slip + fresh * self.rng.standard_normal() for slip in self.slip]
        stay, reach = math.exp(-TICK_S / v.drive.motor_time_constant_s), v.drive.max_wheel_acceleration_radps2 * TICK_S
        means = [0.0, 0.0]
        for i, target in enumerate(command.actuators):
            change = (target - self.wheels[i]) * (1.0 - stay)
            after = self.wheels[i] + min(max(change, -reach), reach)
            if i == self.blocked:
                after = 0.0
            means[i] = 0.5 * (self.wheels[i] + after)
            self.wheels[i] = after
            self.angles[i] += means[i] * TICK_S
        left, right = (means[i] * self.radius[i] * (1.0 - self.slip[i] - self.spin_share) for i in range(2))
        speed, self.yaw_rate = 0.5 * (left + right), (right - left) / v.drive.track_width_m
        ends = [self.wheels[i] * self.radius[i] * (1.0 - self.slip[i] - self.spin_share) for i in range(2)]
        self.accel = (0.5 * sum(ends) - self.speed) / TICK_S
        self.speed = 0.5 * sum(ends)
        middle = self.heading + 0.5 * self.yaw_rate * TICK_S
        side = self.crab_mps if abs(speed) > 0.01 else 0.0
        side -= v.drive.side_slip_rad_per_mps2 * speed * speed * self.yaw_rate
        self.x += (speed * math.cos(middle) - side * math.sin(middle)) * TICK_S
        self.y += (speed * math.sin(middle) + side * math.cos(middle)) * TICK_S
        self.heading += self.yaw_rate * TICK_S

    def _imu(self) -> ImuSample:
        imu, rate = self.noise.imu, math.sqrt(1.0 / TICK_S)
        gyro = self.yaw_rate + self.gyro_bias + imu.gyro_density_radps_rthz * rate * self.rng.standard_normal()
        accel = self.accel + self.accel_bias + imu.accel_density_mps2_rthz * rate * self.rng.standard_normal()
        return ImuSample(0.0, 0.0, gyro, accel, self.speed * self.yaw_rate, GRAVITY_MPS2)

    def _mag(self) -> MagSample:
        mag = self.noise.magnetometer
        keep, fresh = fading(mag.disturbance_rad, mag.disturbance_tau_s)
        self.mag_wander = keep * self.mag_wander + fresh * self.rng.standard_normal()
        seen = self.heading + self.mag_bias + self.mag_wander + mag.white_rad * self.rng.standard_normal()
        return MagSample(FIELD_T * math.sin(seen), FIELD_T * math.cos(seen), -4.8e-5)

    def _gnss(self) -> GnssSample | None:
        gnss = self.noise.gnss
        if self.tick % 10 == 0 and not self.silent:
            for term, (sigma, tau) in enumerate(
                (
                    (gnss.gauss_markov_1_m, gnss.gauss_markov_1_tau_s),
                    (gnss.gauss_markov_2_m, gnss.gauss_markov_2_tau_s),
                )
            ):
                keep, fresh = fading(sigma, tau, 10 * TICK_S)
                self.slow[term] = keep * self.slow[term] + self.rng.normal(0.0, fresh, 2)
            ax, ay = self.vehicle.body.gnss_antenna_x_m, self.vehicle.body.gnss_antenna_y_m
            c, s = math.cos(self.heading), math.sin(self.heading)
            error = self.slow.sum(axis=0) + self.rng.normal(0.0, gnss.white_m, 2) + self.fix_offset_m
            variance = gnss.white_m**2 + gnss.gauss_markov_1_m**2 + gnss.gauss_markov_2_m**2
            sample = GnssSample(
                self.tick * TICK_S,
                self.x + c * ax - s * ay + error[0],
                self.y + s * ax + c * ay + error[1],
                max(variance, 1e-6),
                self.fix,
                20,
                self.correction_age_s,
            )
            self.in_flight.append((self.tick + round(gnss.latency_s / TICK_S), sample))
        if self.in_flight and self.in_flight[0][0] <= self.tick:
            return self.in_flight.popleft()[1]
        return None


def chain(*pieces: tuple[float, float], x: float = 0.0, y: float = 0.0, heading: float = 0.0) -> list[Curve]:
    """Curves end to end from (curvature, length) pieces."""
    curves = []
    for curvature, length in pieces:
        curves.append(Curve(x, y, heading, curvature, length))
        x, y, heading = curves[-1].end
    return curves


def clothoid(curvature: float, length: float, steps: int) -> list[tuple[float, float]]:
    """Pieces that lead from straight to `curvature` in equal steps."""
    return [(curvature * (k + 0.5) / steps, length / steps) for k in range(steps)]


def trajectory(
    curves: list[Curve],
    speed: float = 1.0,
    sprays: tuple[tuple[float, float], ...] = (),
    acceleration: float = 1.0,
    speeds: list[tuple[float, float]] | None = None,
    backward: tuple[int, ...] = (),
) -> Trajectory:
    """A trajectory at one speed with ramps from and to standstill, spraying between the given arc lengths.

    Segments with the indices `backward` are driven backward.
    """
    total = sum(curve.length_m for curve in curves)
    ramp = min(speed**2 / (2 * acceleration), total / 2)
    top = math.sqrt(2 * acceleration * ramp)
    profile = speeds or [(0.0, 0.0), (ramp, top), (total - ramp, top), (total, 0.0)]
    directions = [LinearDirection.BACKWARD if i in backward else LinearDirection.FORWARD for i in range(len(curves))]
    segments = [segment(f"s{i}", curve, directions[i]) for i, curve in enumerate(curves)]
    return assemble(segments, _switches(sprays), (velocity(s, v) for s, v in profile))


def reversing(
    *legs: tuple[int, list[tuple[float, float]]] | float,
    sprays: tuple[tuple[float, float], ...] = (),
    speed: float = 1.0,
    rate: float = 2.0,
) -> Trajectory:
    """A trajectory of legs from standstill to standstill.

    A leg is (+1 or −1, pieces of (curvature of the tangent, length)), or the angle of a turn on the spot.
    """
    x = y = heading = at = 0.0
    segments: list[Segment] = []
    profile: list[PathVelocityParameter] = []
    for leg in legs:
        if isinstance(leg, float):
            segments.append(turn(f"s{len(segments)}", x, y, leg))
            profile.append(velocity(at, math.copysign(rate, leg), VelocityType.ANGULAR))
            heading += leg
            continue
        sense, pieces = leg
        tangent = heading if sense > 0 else heading + math.pi
        for curve in chain(*pieces, x=x, y=y, heading=tangent):
            segments.append(segment(f"s{len(segments)}", curve, sense))
            x, y, tangent = curve.end
        heading = tangent if sense > 0 else tangent - math.pi
        length = sum(piece[1] for piece in pieces)
        ramp = min(speed**2 / 2.0, length / 2.0)
        for s, v in ((0.0, 0.0), (ramp, math.sqrt(2.0 * ramp)), (length - ramp, math.sqrt(2.0 * ramp)), (length, 0.0)):
            profile.append(velocity(at + s, v))
        at += length
    return assemble(segments, _switches(sprays), profile)


def _switches(sprays: tuple[tuple[float, float], ...]) -> list[tuple[float, int]]:
    switches = [(0.0, Actuation.NONE)]
    for start, end in sprays:
        switches += [(start, Actuation.DISC_SPRAY), (end, Actuation.NONE)]
    return switches


@dataclass
class Run:
    """An onboard computer on a rig, and what it did tick by tick."""

    onboard: Onboard
    rig: Rig
    command: Command = STANDSTILL
    painted: list[tuple[float, float]] = field(default_factory=list)  # of the nozzle, along x, valve delays included

    def tick(self) -> Command:
        """One tick; the paint is noted."""
        frame = self.rig.step(self.command)
        before, self.command = self.command, self.onboard.step(frame)
        x, _ = self.rig.nozzle()
        ahead = self.rig.speed * math.cos(self.rig.heading)
        if self.command.valve and not before.valve:
            place = x + ahead * (self.command.valve_after_s + self.rig.vehicle.tool.valve_on_delay_s)
            self.painted.append((place, place))
        if before.valve:
            closes_s = self.command.valve_after_s + self.rig.vehicle.tool.valve_off_delay_s
            end = x + ahead * (0.0 if self.command.valve else closes_s)
            self.painted[-1] = (self.painted[-1][0], end)
        return self.command

    def ticks(self, count: int) -> None:
        """Several ticks."""
        for _ in range(count):
            self.tick()

    def until(self, *states: int, limit: int = 20000) -> int:
        """Ticks until one of the states is reached; fails if it is not within `limit`."""
        for count in range(limit):
            if self.onboard.state in states:
                return count
            self.tick()
        raise AssertionError(f"still {self.onboard.status} after {limit} ticks")

    def until_arc(self, arc_length_m: float, limit: int = 20000) -> None:
        """Ticks until the robot has come so far."""
        for _ in range(limit):
            if self.onboard.status.arc_length_m >= arc_length_m:
                return
            self.tick()
        raise AssertionError(f"still at {self.onboard.status.arc_length_m} m after {limit} ticks")


def start(
    plan: Trajectory, follower: str = "pure-pursuit", noise: str = "none", seed: int = 0, vehicle: Vehicle | None = None
) -> Run:
    """A run whose traversal has been loaded and started, the robot at the start of the path.

    Its follower is the one that takes least time.
    """
    vehicle = vehicle or Vehicle()
    scenario = Scenario(noise=noise)
    rig = Rig(vehicle, scenario, seed, *start_pose(plan))
    run = Run(Onboard(vehicle, OnboardConfig(follower=follower)), rig)
    run.onboard.load(plan)
    run.onboard.start()
    return run
