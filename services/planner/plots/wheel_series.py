"""What the wheels do along a plan: their speed and acceleration, exact at every sample, turns on the spot included."""

from dataclasses import dataclass

import numpy as np

from touchline.schemas.vehicle import Vehicle
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.plan import Plan
from touchline.services.planner.speed.timing import Spin

SPIN_SAMPLES = 21
# Borders closer than this (m) are one, blurred by rounding.
BORDER_M = 1e-8


@dataclass(frozen=True)
class WheelSeries:
    """Samples (n,) in the order of time.

    Attributes:
        time_s, station_m: When, and at which arc length of what is sent.
        speed_mps: Of the middle of the axle; negative when driving backward.
        curvature_1pm, sharpness_1pm2: Of the ideal curve there.
        wheel_radps, wheel_radps2: (2, n) speed and acceleration of the left and the right wheel.
    """

    time_s: Floats
    station_m: Floats
    speed_mps: Floats
    curvature_1pm: Floats
    sharpness_1pm2: Floats
    wheel_radps: Floats
    wheel_radps2: Floats

    def violations(self, vehicle: Vehicle, slack: float = 1e-6) -> int:
        """Samples at which a wheel is faster or accelerates harder than it can, by more than a share of `slack`."""
        speed = np.abs(self.wheel_radps).max(axis=0) > vehicle.max_wheel_speed_radps * (1.0 + slack)
        gain = np.abs(self.wheel_radps2).max(axis=0) > vehicle.max_wheel_acceleration_radps2 * (1.0 + slack)
        return int(np.count_nonzero(speed | gain))


def wheel_series(plan: Plan, vehicle: Vehicle, step_m: float = 0.01) -> WheelSeries:
    """The wheels along `plan`, sampled in the middle of stretches of at most `step_m` between all borders.

    A rim runs at v(1 ∓ κr) and accelerates with a(1 ∓ κr) ∓ v²σr (r: half the track; left: upper sign).
    """
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
    # As in the plan's report: v² over the ideal curve, which is a little longer than the arcs that stand for it.
    cut = np.clip(np.searchsorted(sent_at, station) - 1, 0, len(plan.sent) - 1)
    shorter = np.divide(np.diff(sent_at), np.diff(ideal_at), out=np.ones(len(plan.sent)), where=np.diff(ideal_at) > 0.0)
    gain = ((squares[1:] - squares[:-1]) / (2.0 * np.diff(knots)))[entry] * shorter[cut]
    square = np.interp(station, knots, squares)
    speed = np.sqrt(square)
    left = plan.speeds.time_s + plan.speeds.dwell_s
    time = left[entry] + 2.0 * (station - knots[entry]) / (plan.speeds.speed_mps[entry] + speed)

    reach, turning = vehicle.half_track_m * curvature, vehicle.half_track_m * square * sharpness
    rims = direction * np.stack((speed * (1.0 - reach), speed * (1.0 + reach)))
    gains = direction * np.stack((gain * (1.0 - reach) - turning, gain * (1.0 + reach) + turning))
    driven = WheelSeries(
        time,
        station,
        direction * speed,
        curvature,
        sharpness,
        rims / vehicle.wheel_radius_m,
        gains / vehicle.wheel_radius_m,
    )
    spins = [_spun(plan, vehicle, spin) for spin in plan.speeds.spins]
    return _merged([driven, *spins]) if spins else driven


def _spun(plan: Plan, vehicle: Vehicle, spin: Spin) -> WheelSeries:
    """A turn on the spot: up to its rate, along at it, and down, all at one acceleration."""
    entry = int(np.argmin(np.abs(plan.speeds.station_m - spin.station_m)))
    gain = spin.rate_radps / (spin.seconds - spin.angle_rad / spin.rate_radps)
    since = np.linspace(0.0, spin.seconds, SPIN_SAMPLES)
    ramp = np.abs(spin.rate_radps / gain)
    shape = np.clip(np.minimum(since, spin.seconds - since) / ramp, 0.0, 1.0)
    slope = np.where(since < ramp, 1.0, np.where(since > spin.seconds - ramp, -1.0, 0.0))
    sides = np.array([[-1.0], [1.0]]) * vehicle.half_track_m / vehicle.wheel_radius_m
    still = np.zeros(SPIN_SAMPLES)
    return WheelSeries(
        float(plan.speeds.time_s[entry]) + since,
        still + spin.station_m,
        still,
        still,
        still,
        sides * spin.rate_radps * shape,
        sides * gain * slope,
    )


def _merged(parts: list[WheelSeries]) -> WheelSeries:
    order = np.argsort(np.concatenate([part.time_s for part in parts]), kind="stable")

    def column(name: str) -> Floats:
        return np.asarray(np.concatenate([getattr(part, name) for part in parts], axis=-1)[..., order])

    return WheelSeries(*(column(name) for name in WheelSeries.__dataclass_fields__))
