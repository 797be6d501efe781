"""Energy of a plan from the battery: idle power, and the drive's power over the speed profile.

The ground is level and dry. The robot begins with a full tank and gets lighter as it paints; an empty tank is refilled.
"""

import numpy as np

from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.drives.planned_drive import PlannedDrive
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.segments.sent_segments import Sent
from touchline.services.planner.speed.timing import SpeedProfile

SECONDS_PER_HOUR = 3600.0
STEP_S = 0.02
"""Sampling of the power; coarser for jobs of hours, so that there are at most MOST_STEPS."""
MOST_STEPS = 500_000


def battery_wh(sent: list[Sent], speeds: SpeedProfile, vehicle: Vehicle, drive: PlannedDrive) -> float:
    """Energy of a whole plan (Wh).

    Args:
        sent: Lines and arcs of the plan.
        speeds: Speeds along them.
        vehicle: Vehicle with its battery and tank.
        drive: Planning model of its drive.
    """
    step_s = max(STEP_S, speeds.total_time_s / MOST_STEPS)
    station_m, speed_mps, spinning_radps = _over_time(speeds, step_s)
    mass_kg = _mass_kg(station_m, sent, speeds, vehicle)
    yaw_rate_radps = spinning_radps + _curvature_1pm(station_m, sent) * speed_mps
    power_w = vehicle.body.idle_power_w + drive.power_w(speed_mps, yaw_rate_radps, mass_kg, step_s)
    return float(np.mean(power_w)) * speeds.total_time_s / SECONDS_PER_HOUR


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
    """Curvature (n,) of the path at arc lengths (n,), smoothed over the steps between the arcs that are sent."""
    driven = [piece for piece in sent if piece.end_m > piece.start_m]
    middle = [0.5 * (piece.start_m + piece.end_m) for piece in driven]
    return np.interp(station_m, middle, [piece.curve.curvature_1pm for piece in driven])


def _mass_kg(station_m: Floats, sent: list[Sent], speeds: SpeedProfile, vehicle: Vehicle) -> Floats:
    """Mass (n,) of the robot at arc lengths (n,); constant without a tank."""
    at_m, used_l = [0.0], [0.0]
    full_l, empty_kg, full_kg = vehicle.tool.capacity_l, vehicle.body.mass_empty_kg, vehicle.mass_full_kg
    if not full_l:
        return np.full(len(station_m), full_kg)
    flow_lps = vehicle.tool.flow_lps
    for piece in sent:
        painting_s = speeds.time_at(piece.end_m) - speeds.time_at(piece.start_m) if piece.stroke else 0.0
        at_m.append(piece.end_m)
        used_l.append(used_l[-1] + flow_lps * painting_s)
    left_l = full_l - np.interp(station_m, at_m, used_l) % full_l
    return np.asarray(empty_kg + (full_kg - empty_kg) * left_l / full_l)
