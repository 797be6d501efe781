"""One scan of a lidar as a kernel: poses of the beams, what they meet, and errors."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing
from touchline.core.random import STREAM_AUXILIARY, normal, uniform
from touchline.onboard.interface import TICK_S
from touchline.services.robot_sim.sensors.rays import CastBeams, ScanOrigin, meet_disc, meet_solids, solids_in_reach
from touchline.services.robot_sim.world.objects.things import (
    EAST,
    EAST_MPS,
    M_DARK,
    M_HEIGHT,
    M_RADIUS,
    NORTH,
    NORTH_MPS,
    POSES,
    Things,
)

Floats = NDArray[np.float64]

_EDGE_M: Final = 0.3  # between neighbours farther apart, a beam may see both


class LidarFigures(NamedTuple):
    """Constants of a lidar and its errors; see `LidarSpec` and `LidarTruth`.

    Attributes:
        x_m: Mounting place, with `y_m`.
        y_m: See `x_m`.
        first_rad: Direction of the first beam, body frame.
        step_rad: Angle from beam to beam.
        scan_s: Time from the first beam to the last.
        height_m: Height of the plane at the sensor.
        descent: Tangent of the plane's angle, nose down.
        min_m: Shortest range.
        max_m: Longest range, of a light surface.
        dark_m: Longest range of a dark one.
        sigma_m: Noise of a range.
        sigma_relative: Noise that grows with the range.
        ground_sigma: Noise of returns of the ground, a share of the range.
        bias_m: Error that the session shares.
        mixed: Probability that a beam beside an edge sees both surfaces.
        dropout: Probability that a beam has no return.
        false_returns: Probability that a beam has a false one.
        false_within_m: Longest range of false returns.
        sun_rad: Direction of the sun, map frame; nan if it is high or hidden.
        sun_half_rad: Half the angle in which the sun dazzles.
        sun_dropout: Probability that a beam in it has no return.
        seed: Seed of the scenario.
        sensor: Number of the sensor.
        silent: True in a scenario without noise.
    """

    x_m: float
    y_m: float
    first_rad: float
    step_rad: float
    scan_s: float
    height_m: float
    descent: float
    min_m: float
    max_m: float
    dark_m: float
    sigma_m: float
    sigma_relative: float
    ground_sigma: float
    bias_m: float
    mixed: float
    dropout: float
    false_returns: float
    false_within_m: float
    sun_rad: float
    sun_half_rad: float
    sun_dropout: float
    seed: int
    sensor: int
    silent: bool


class ScanArrays(NamedTuple):
    """Arrays of a lidar, each with a row per beam.

    Attributes:
        directions: (n, 2) unit vectors, body frame.
        rays: (n, 4), as in `CastBeams`.
        drop: (n,), as in `CastBeams`.
        age_s: (n,), as in `CastBeams`.
        ranges: (n,) true ranges.
        dark: (n,), as in `CastBeams`.
        measured: (n,) measured ranges, rounded to single precision as messages carry them; inf for none.
    """

    directions: Floats
    rays: Floats
    drop: Floats
    age_s: Floats
    ranges: Floats
    dark: Floats
    measured: Floats


@borrowing
def _swept(lidar: LidarFigures, scan: ScanArrays, trail: Floats, tick: int) -> ScanOrigin:
    """Return the reference at the last beam, and how far the robot moves and turns from it during the scan."""
    end = trail[tick % POSES]
    cos, sin = math.cos(end[2]), math.sin(end[2])
    east = end[0] + cos * lidar.x_m - sin * lidar.y_m
    north = end[1] + sin * lidar.x_m + cos * lidar.y_m
    moved, turned = 0.0, 0.0
    # The corner of the polyline of poses that is farthest from the reference bounds what lies before it.
    for back in range(int(scan.age_s[0] / TICK_S) + 2):
        pose = trail[(tick - back) % POSES]
        cos, sin = math.cos(pose[2]), math.sin(pose[2])
        aside_east = pose[0] + cos * lidar.x_m - sin * lidar.y_m - east
        aside_north = pose[1] + sin * lidar.x_m + cos * lidar.y_m - north
        moved = max(moved, math.sqrt(aside_east * aside_east + aside_north * aside_north))
        turned = max(turned, abs(pose[2] - end[2]))
    return ScanOrigin(east, north, moved, turned)


@borrowing
def _aim(lidar: LidarFigures, scan: ScanArrays, trail: Floats, tick: int) -> None:
    """Fill in the beams' rays along the robot's true motion."""
    before = -1
    cos, sin, from_east, from_north, rate_radps = 1.0, 0.0, 0.0, 0.0, 0.0
    east_mps, north_mps = 0.0, 0.0
    for beam in range(len(scan.ranges) - 1, -1, -1):
        back = int(scan.age_s[beam] / TICK_S)
        if back != before:
            before = back
            new, old = trail[(tick - back) % POSES], trail[(tick - back - 1) % POSES]
            cos, sin = math.cos(new[2]), math.sin(new[2])
            from_east = new[0] + cos * lidar.x_m - sin * lidar.y_m
            from_north = new[1] + sin * lidar.x_m + cos * lidar.y_m
            old_cos, old_sin = math.cos(old[2]), math.sin(old[2])
            east_mps = (old[0] + old_cos * lidar.x_m - old_sin * lidar.y_m - from_east) / TICK_S
            north_mps = (old[1] + old_sin * lidar.x_m + old_cos * lidar.y_m - from_north) / TICK_S
            rate_radps = (old[2] - new[2]) / TICK_S
        since = scan.age_s[beam] - back * TICK_S
        angle = rate_radps * since  # small: a tick's at most
        turn_sin, turn_cos = angle, 1.0
        if angle != 0.0:
            turn_sin, turn_cos = math.sin(angle), math.cos(angle)
        beam_cos, beam_sin = cos * turn_cos - sin * turn_sin, sin * turn_cos + cos * turn_sin
        x, y, ray = scan.directions[beam, 0], scan.directions[beam, 1], scan.rays[beam]
        ray[0], ray[1] = from_east + east_mps * since, from_north + north_mps * since
        ray[2], ray[3] = beam_cos * x - beam_sin * y, beam_sin * x + beam_cos * y


@borrowing
def _any_in_reach(reference: ScanOrigin, scan: ScanArrays, things: Things, most_m: float) -> bool:
    """Return whether a beam of this length may meet a thing; False is certain."""
    if solids_in_reach(reference, things.grid, most_m):
        return True
    movers, figures = things.movers, things.figures
    for i in range(len(movers)):
        east, north = movers[i, EAST] - reference.east_m, movers[i, NORTH] - reference.north_m
        moved = math.hypot(movers[i, EAST_MPS], movers[i, NORTH_MPS]) * scan.age_s[0]
        if math.hypot(east, north) - figures[i, M_RADIUS] - moved - reference.moved_m <= most_m:
            return True
    return False


@borrowing
def _meet(lidar: LidarFigures, scan: ScanArrays, things: Things, reference: ScanOrigin, heading_rad: float) -> None:
    """Enter what the aimed beams meet, whatever its range."""
    first_rad = heading_rad + lidar.first_rad
    beams = CastBeams(
        scan.rays, scan.drop, scan.age_s, scan.ranges, scan.dark, first_rad, lidar.step_rad, lidar.height_m, lidar.max_m
    )
    meet_solids(beams, reference, things.grid)
    movers, figures = things.movers, things.figures
    for i in range(len(movers)):
        disc = (movers[i, EAST], movers[i, NORTH], figures[i, M_RADIUS])
        velocity = (movers[i, EAST_MPS], movers[i, NORTH_MPS])
        meet_disc(beams, reference, disc, velocity, figures[i, M_HEIGHT], figures[i, M_DARK])


@borrowing
def see(lidar: LidarFigures, scan: ScanArrays, things: Things, tick: int) -> bool:
    """Compute the true ranges of a scan that ends with a tick; inf where there is nothing within range.

    Args:
        lidar: Constants.
        scan: Ranges and surfaces are filled in, and rays if a thing is within range; negative ranges are those of the
            ground.
        things: Things around the robot, and its poses.
        tick: Tick that ends.

    Returns:
        False if no beam meets anything.
    """
    reference = _swept(lidar, scan, things.trail, tick)
    for beam in range(len(scan.ranges)):
        scan.ranges[beam], scan.dark[beam] = math.inf, 0.0
    if _any_in_reach(reference, scan, things, lidar.max_m):
        _aim(lidar, scan, things.trail, tick)
        _meet(lidar, scan, things, reference, things.trail[tick % POSES][2])
    found = False
    for beam in range(len(scan.ranges)):
        most = lidar.dark_m if scan.dark[beam] else lidar.max_m
        distance = scan.ranges[beam] if scan.ranges[beam] <= most else math.inf
        if scan.drop[beam] > 0.0:
            ground = lidar.height_m / scan.drop[beam]
            if ground < distance and ground <= lidar.dark_m:
                distance = -ground
        scan.ranges[beam] = distance
        found = found or math.isfinite(distance)
    return found


@borrowing
def _between_edges(lidar: LidarFigures, ranges: Floats, beam: int, share: float) -> float:
    """Return the range of a beam that may see both sides of an edge, by a random number in [0, 1)."""
    near: float = abs(ranges[beam])
    for side in range(2):
        other = beam + 2 * side - 1
        if 0 <= other < len(ranges):
            far = abs(ranges[other])
            chance = share - side * lidar.mixed
            if math.isfinite(far) and abs(far - near) > _EDGE_M and 0.0 <= chance < lidar.mixed:
                mixed: float = near + (far - near) * chance / lidar.mixed
                return mixed
    return near


@borrowing
def measure_scan(
    lidar: LidarFigures, scan: ScanArrays, things: Things, tick: int, blind: bool, more_false_returns: float
) -> None:
    """Measure a scan that ends with a tick.

    Args:
        lidar: Constants.
        scan: Measured ranges are filled in.
        things: Things around the robot, and its poses.
        tick: Tick that ends.
        blind: True if no light returns.
        more_false_returns: Probability of false returns by a fault.
    """
    found = see(lidar, scan, things, tick)
    ranges, seed, channel = scan.ranges, lidar.seed, lidar.sensor
    heading = things.trail[tick % POSES][2]
    false_returns = lidar.false_returns + more_false_returns
    if blind or not (found or false_returns > 0.0):  # no random number matters
        for beam in range(len(ranges)):
            scan.measured[beam] = math.inf
        return
    sunny = not math.isnan(lidar.sun_rad)
    for beam in range(len(ranges)):
        true_m = ranges[beam]
        distance = abs(true_m)
        noise, share = 0.0, 1.0
        if not lidar.silent or more_false_returns > 0.0:
            share = uniform(seed, STREAM_AUXILIARY, tick, channel + 2 * beam)
        dropout = lidar.dropout
        if sunny:
            aside = heading + lidar.first_rad + beam * lidar.step_rad - lidar.sun_rad
            if math.cos(aside) > math.cos(lidar.sun_half_rad):
                dropout = max(dropout, lidar.sun_dropout)
        if lidar.silent:
            dropout = 0.0
        if share < dropout:
            distance = math.inf
        elif share < dropout + false_returns:
            distance = lidar.min_m + (lidar.false_within_m - lidar.min_m) * (share - dropout) / false_returns
        elif math.isfinite(distance):
            if not lidar.silent:
                rest = (share - dropout - false_returns) / (1.0 - dropout - false_returns)
                distance = _between_edges(lidar, ranges, beam, rest)
                sigma = lidar.sigma_m + lidar.sigma_relative * distance
                if true_m < 0.0:
                    sigma += lidar.ground_sigma * distance
                noise = sigma * normal(seed, STREAM_AUXILIARY, tick, channel + 2 * beam + 1)
            distance += noise + lidar.bias_m
        if not lidar.min_m <= distance <= lidar.max_m:
            distance = math.inf
        scan.measured[beam] = np.float32(distance)
