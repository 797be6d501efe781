"""Time series of the actuators along a plan, turns on the spot included; exact at every sample."""

from dataclasses import dataclass

import numpy as np

from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.plan import Plan
from touchline.services.planner.speed.timing import Spin

SPIN_SAMPLES = 21
# Borders closer than this (m) differ by rounding and are merged.
BORDER_M = 1e-8


@dataclass(frozen=True)
class ActuatorSeries:
    """Samples (n,) in the order of time.

    Attributes:
        time_s, station_m: Time, and arc length of what is sent.
        speed_mps: Speed of the middle of the axle; negative when driving backward.
        curvature_1pm, sharpness_1pm2: Curvature and sharpness of the ideal curve.
        value, rate: (k, n) value of each of the drive's actuators, and its change per second.
    """

    time_s: Floats
    station_m: Floats
    speed_mps: Floats
    curvature_1pm: Floats
    sharpness_1pm2: Floats
    value: Floats
    rate: Floats

    def violations(self, vehicle: Vehicle) -> int:
        """Number of samples at which an actuator exceeds its limits by more than rounding (1e-6 of them)."""
        limits = np.array([(each.limit, each.rate_limit) for each in vehicle.drive.actuators]) * (1.0 + 1e-6)
        beyond = (np.abs(self.value) > limits[:, :1]) | (np.abs(self.rate) > limits[:, 1:])
        return int(np.count_nonzero(beyond.any(axis=0)))


def actuator_series(plan: Plan, step_m: float = 0.01) -> ActuatorSeries:
    """Sample the actuators along `plan` in the middle of stretches of at most `step_m` between all borders."""
    pieces = [piece for section in plan.sections for piece in section.path.pieces]
    table = np.array([(p.length_m, p.curvature_1pm, p.sharpness_1pm2, p.direction) for p in pieces])
    ends = np.cumsum(table[:, 0])
    ideal_at = np.array([0.0, *(sent.ideal_to_m for sent in plan.sent)])
    sent_at = np.array([0.0, *(sent.end_m for sent in plan.sent)])
    knots = plan.speeds.station_m
    even = np.linspace(0.0, sent_at[-1], max(2, int(sent_at[-1] / step_m) + 2))
    border = np.unique(np.concatenate((even, knots, sent_at, np.interp(ends, ideal_at, sent_at))))
    border = border[np.concatenate((np.diff(border) > BORDER_M, [True]))]
    station = 0.5 * (border[1:] + border[:-1])

    ideal = np.interp(station, sent_at, ideal_at)
    index = np.minimum(np.searchsorted(ends, ideal), len(table) - 1)
    length, curvature, sharpness, direction = table[index].T
    curvature = curvature + sharpness * (ideal - (ends[index] - length))
    squares = np.square(plan.speeds.speed_mps)
    entry = np.clip(np.searchsorted(knots, station, side="right") - 1, 0, len(knots) - 2)
    # As in the plan's report: v² over the ideal curve, which is a little longer than the arcs.
    cut = np.clip(np.searchsorted(sent_at, station) - 1, 0, len(plan.sent) - 1)
    shorter = np.divide(np.diff(sent_at), np.diff(ideal_at), out=np.ones(len(plan.sent)), where=np.diff(ideal_at) > 0.0)
    gain = ((squares[1:] - squares[:-1]) / (2.0 * np.diff(knots)))[entry] * shorter[cut]
    square = np.interp(station, knots, squares)
    speed = np.sqrt(square)
    left = plan.speeds.time_s + plan.speeds.dwell_s
    time = left[entry] + 2.0 * (station - knots[entry]) / (plan.speeds.speed_mps[entry] + speed)

    motion = plan.limits.drive.actuation(direction, square, gain, curvature, sharpness)
    driven = ActuatorSeries(time, station, direction * speed, curvature, sharpness, motion.value, motion.rate)
    spins = [_spun(plan, spin) for spin in plan.speeds.spins]
    return _merged([driven, *spins]) if spins else driven


def _spun(plan: Plan, spin: Spin) -> ActuatorSeries:
    """Sample a turn on the spot: constant acceleration, constant rate, constant deceleration."""
    entry = int(np.argmin(np.abs(plan.speeds.station_m - spin.station_m)))
    gain = spin.rate_radps / (spin.seconds - spin.angle_rad / spin.rate_radps)
    since = np.linspace(0.0, spin.seconds, SPIN_SAMPLES)
    ramp = np.abs(spin.rate_radps / gain)
    shape = np.clip(np.minimum(since, spin.seconds - since) / ramp, 0.0, 1.0)
    slope = np.where(since < ramp, 1.0, np.where(since > spin.seconds - ramp, -1.0, 0.0))
    still = np.zeros(SPIN_SAMPLES)
    return ActuatorSeries(
        float(plan.speeds.time_s[entry]) + since,
        still + spin.station_m,
        still,
        still,
        still,
        plan.limits.drive.spinning(spin.rate_radps) * shape,
        plan.limits.drive.spinning(gain) * slope,
    )


def _merged(parts: list[ActuatorSeries]) -> ActuatorSeries:
    order = np.argsort(np.concatenate([part.time_s for part in parts]), kind="stable")

    def column(name: str) -> Floats:
        return np.asarray(np.concatenate([getattr(part, name) for part in parts], axis=-1)[..., order])

    return ActuatorSeries(*(column(name) for name in ActuatorSeries.__dataclass_fields__))
