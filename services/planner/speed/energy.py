"""What a plan takes from the battery: the drives' power over its speed profile, on level, dry grass.

Torque overcomes rolling resistance, the drives' own friction and the inertia of body and wheels, in turns, too; gears
and windings lose some. Braking gives back at most what the other losses take. The robot begins with a full tank and
gets lighter as it paints; an empty tank is filled up.
"""

import numpy as np

from touchline.schemas.vehicle import Vehicle
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.segments.sent_segments import Sent
from touchline.services.planner.speed.timing import SpeedProfile

SECONDS_PER_HOUR = 3600.0
GRAVITY_MPS2 = 9.81
ROLLING_ON_GRASS = 0.06
STEP_S = 0.02
"""Between two looks at the drives; longer for jobs of hours, of which there are at most MOST_STEPS."""
MOST_STEPS = 500_000


def battery_wh(sent: list[Sent], speeds: SpeedProfile, vehicle: Vehicle) -> float:
    """Of a whole plan, Wh: idle power all the time, and what the drives draw."""
    step_s = max(STEP_S, speeds.total_time_s / MOST_STEPS)
    station_m, speed_mps, spinning_radps = _over_time(speeds, step_s)
    mass_kg = _mass_kg(station_m, sent, speeds, vehicle)
    yaw_rate_radps = spinning_radps + _curvature_1pm(station_m, sent) * speed_mps
    power_w = vehicle.idle_power_w + drive_power_w(vehicle, speed_mps, yaw_rate_radps, mass_kg, step_s)
    return float(np.mean(power_w)) * speeds.total_time_s / SECONDS_PER_HOUR


def drive_power_w(
    vehicle: Vehicle, speed_mps: Floats, yaw_rate_radps: Floats, mass_kg: Floats, step_s: float
) -> Floats:
    """What both drives draw (W) (n,) at speeds, yaw rates and masses (n,) that are `step_s` apart."""
    motor, radius_m, half_m = vehicle.motor, vehicle.wheel_radius_m, vehicle.half_track_m
    ahead_n = 0.5 * mass_kg * np.gradient(speed_mps, step_s)
    turning_n = mass_kg * vehicle.radius_of_gyration_m**2 * np.gradient(yaw_rate_radps, step_s) / (2.0 * half_m)
    drawn_w = np.zeros(len(speed_mps))
    for side in (-1.0, 1.0):
        rate_radps = (speed_mps + side * half_m * yaw_rate_radps) / radius_m
        drag_nm = 0.5 * ROLLING_ON_GRASS * GRAVITY_MPS2 * mass_kg * radius_m + motor.friction_nm
        torque_nm = np.sign(rate_radps) * drag_nm + motor.viscous_nms * rate_radps
        torque_nm += radius_m * (ahead_n + side * turning_n) + motor.inertia_kgm2 * np.gradient(rate_radps, step_s)
        current_a = torque_nm / (motor.gear_ratio * motor.gear_efficiency * motor.constant_nm_per_a)
        drawn_w += torque_nm * rate_radps / motor.gear_efficiency + motor.resistance_ohm * current_a**2
    return np.maximum(drawn_w, 0.0)


def _over_time(speeds: SpeedProfile, step_s: float) -> tuple[Floats, Floats, Floats]:
    """Arc length (m), speed (m/s) and rate of turning on the spot (rad/s) (n,), every `step_s`."""
    count = max(round(speeds.total_time_s / step_s), 2)
    time_s = (np.arange(count) + 0.5) * step_s
    known_s = np.column_stack((speeds.time_s, speeds.time_s + speeds.dwell_s)).ravel()
    known_m, known_mps = np.repeat(speeds.station_m, 2), np.repeat(speeds.speed_mps, 2)
    speed = np.interp(time_s, known_s, known_mps)
    last = np.maximum(np.searchsorted(known_s, time_s, side="right") - 1, 0)
    station = known_m[last] + 0.5 * (known_mps[last] + speed) * (time_s - known_s[last])
    spinning = np.zeros(count)
    for spin in speeds.spins:
        begun_s = speeds.time_at(spin.station_m)
        first, end = np.searchsorted(time_s, (begun_s, begun_s + spin.seconds))
        since = time_s[first:end] - begun_s
        ramp_s = max(spin.seconds - abs(spin.angle_rad / spin.rate_radps), step_s)
        spinning[first:end] = spin.rate_radps * np.minimum(np.minimum(since, spin.seconds - since) / ramp_s, 1.0)
    return station, speed, spinning


def _curvature_1pm(station_m: Floats, sent: list[Sent]) -> Floats:
    """Of the path at these arc lengths (n,), without the steps between the arcs that are sent."""
    driven = [piece for piece in sent if piece.end_m > piece.start_m]
    middle = [0.5 * (piece.start_m + piece.end_m) for piece in driven]
    return np.interp(station_m, middle, [piece.curve.curvature_1pm for piece in driven])


def _mass_kg(station_m: Floats, sent: list[Sent], speeds: SpeedProfile, vehicle: Vehicle) -> Floats:
    """Of the robot at these arc lengths (n,)."""
    at_m, used_l = [0.0], [0.0]
    flow_lps = vehicle.paint_l_per_m * vehicle.paint_speed_mps
    for piece in sent:
        painting_s = speeds.time_at(piece.end_m) - speeds.time_at(piece.start_m) if piece.stroke else 0.0
        at_m.append(piece.end_m)
        used_l.append(used_l[-1] + flow_lps * painting_s)
    left_l = vehicle.tank_l - np.interp(station_m, at_m, used_l) % vehicle.tank_l
    return vehicle.mass_empty_kg + (vehicle.mass_full_kg - vehicle.mass_empty_kg) * left_l / vehicle.tank_l
