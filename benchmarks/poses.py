"""Paths to poses: times beside a study's, how much they turn, limits at every millisecond, free headings, and speed."""

import math
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.plugins import SPEED_LAWS
from touchline.schemas.vehicles.shipped import TURTLEBOT2, TURTLEBOT3_WAFFLE_PI
from touchline.services.core.jit import kernel
from touchline.services.planner.drives.caps import Caps
from touchline.services.planner.geometry.clothoid import Floats, PathPose, PiecePath
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.planner.plan import Plan
from touchline.services.planner.poses.cubic_path import CURVATURE_SHARE, CubicPath, curve_of
from touchline.services.planner.poses.kernels.cubic_curve import (
    FINE,
    SLOWEST_SHARE,
    Terms,
    cubic_curve,
    price,
    quickest_lengths,
    tangent,
)
from touchline.services.planner.poses.kernels.free_heading import shortest_lengths
from touchline.services.planner.poses.shipped_methods import BEARING, G2, TURN_LINE_TURN
from touchline.services.planner.poses.times import rest_to_rest_s
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.steering.plain_words import plain_word

ORIGIN = PathPose(0.0, 0.0, 0.0)
WAFFLE = Traveller.of(TURTLEBOT3_WAFFLE_PI, PlanOptions())
SPEED_MPS, YAW_RADPS = 0.26, 1.82
STUDY_TANGENT_M = 10.0
# How finely a cubic curve with a standstill on the way is looked at.
VERY_FINE = 20_000


class BodyCaps(NamedTuple):
    """The study's limits: speed (m/s) and yaw rate (rad/s) apart, whatever the wheels, and no acceleration's."""

    speed_mps: float
    yaw_radps: float

    @kernel
    def square_cap(self, curvature: float, _sharpness: float) -> float:
        """The largest v² (m²/s²) at a curvature (1/m)."""
        square = self.speed_mps**2
        if curvature > 0.0:
            square = min(square, (self.yaw_radps / curvature) ** 2)
        return float(square)


STUDY_CAPS = Caps(SPEED_MPS, math.inf, math.inf, BodyCaps(SPEED_MPS, YAW_RADPS))
BY_LIMITS = np.zeros(0)
ANY = Terms(math.inf, 0.0, BY_LIMITS, STUDY_CAPS)


def main() -> None:
    """Print all figures."""
    _least_times()
    _turning()
    _quickness()
    _limits()
    _free_headings()
    _dubins_times()


def _goals(count: int, seed: int) -> list[PathPose]:
    rng = np.random.default_rng(seed)
    return [PathPose(*row) for row in rng.uniform((-5.0, -5.0, -math.pi), (5.0, 5.0, math.pi), (count, 3)).tolist()]


def _piece_time_s(path: PiecePath) -> float:
    """Seconds along pieces under the study's limits."""
    seconds = 0.0
    for piece in path.pieces:
        curvature = np.abs(piece.curvature_1pm + piece.sharpness_1pm2 * np.linspace(0.0, piece.length_m, 33))
        pace = np.maximum(1.0 / SPEED_MPS, curvature / YAW_RADPS)
        seconds += piece.length_m * float(np.mean(pace)) + abs(piece.spin_rad) / YAW_RADPS
    return seconds


def _cubic_time_s(goal: PathPose, tightest: float, backward: bool) -> float:
    """Seconds along the chosen curve; infinite if there is none."""
    terms = Terms(tightest, SLOWEST_SHARE * abs(goal.point), BY_LIMITS, STUDY_CAPS)
    lengths = quickest_lengths(goal.point, goal.heading_rad, backward, terms)
    if math.isnan(lengths[0]):
        return math.inf
    return float(price(curve_of(ORIGIN, goal, lengths), ANY, FINE))


def _least_times() -> None:
    goals = _goals(600, 4)
    tightest = CURVATURE_SHARE * WAFFLE.limits.curvature_max_1pm

    def given(tangent_m: float, goal: PathPose) -> float:
        curve = cubic_curve(0j, goal.point, complex(tangent_m), tangent_m * goal.direction)
        return float(price(curve, ANY, VERY_FINE))

    fixed = np.array([given(STUDY_TANGENT_M, goal) for goal in goals])
    print(f"least time to 600 goals in [-5, 5]² m, {SPEED_MPS} m/s and {YAW_RADPS} rad/s, seconds:")
    g2 = np.array([_piece_time_s(G2.between(ORIGIN, goal, WAFFLE).path) for goal in goals])
    kept = np.array([_cubic_time_s(goal, tightest, True) for goal in goals])
    print(f"  cubic curves within {WAFFLE.limits.curvature_max_1pm:.2f} 1/m found for {np.isfinite(kept).mean():.0%}")
    rows = {
        "k = 10": fixed,
        "k = distance": np.array([given(abs(goal.point), goal) for goal in goals]),
        "chosen, forward, any curvature": np.array([_cubic_time_s(goal, math.inf, False) for goal in goals]),
        "chosen, any curvature": np.array([_cubic_time_s(goal, math.inf, True) for goal in goals]),
        "chosen, curvature kept, else g2": np.where(np.isfinite(kept), kept, g2),
        "g2": g2,
        "turn, line, turn": np.array(
            [_piece_time_s(TURN_LINE_TURN.between(ORIGIN, goal, WAFFLE).path) for goal in goals]
        ),
    }
    for name, seconds in rows.items():
        slower = int(np.count_nonzero(seconds > fixed * (1.0 + 1e-9)))  # or not there at all
        there = np.isfinite(seconds)
        ratio = float(np.mean(seconds[there] / fixed[there]))
        print(f"  {name:33} median {np.median(seconds):6.2f}  mean ratio {ratio:.3f}  slower than k = 10: {slower}")


def _turning() -> None:
    rng = np.random.default_rng(5)
    chosen, fixed = [], []
    for _ in range(300):
        bearing, onward = rng.uniform(-1.0, 1.0, 2) * math.pi / 3.0
        place = rng.uniform(0.3, 8.0) * complex(math.cos(bearing), math.sin(bearing))
        goal = PathPose(place.real, place.imag, bearing + onward)
        path = CubicPath().between(ORIGIN, goal, WAFFLE).path
        chosen.append(math.degrees(sum(abs(piece.turn_at(piece.length_m)) for piece in path.pieces)))
        ways = tangent(curve_of(ORIGIN, goal, (STUDY_TANGENT_M, STUDY_TANGENT_M)), np.linspace(0.0, 1.0, VERY_FINE))
        fixed.append(math.degrees(np.abs(np.angle(ways[1:] / ways[:-1])).sum()))
    wound = np.mean(np.array(fixed) > 200.0)
    print(f"300 goals ahead: chosen curves turn by {max(chosen):.0f}° at most,")
    print(f"  k = 10 by more than 200° on {wound:.0%}, up to {max(fixed):.0f}°")


def _quickness() -> None:
    goals = _goals(500, 6)
    took = []
    for goal in goals:
        begin = time.perf_counter()
        found = CubicPath().between(ORIGIN, goal, WAFFLE)
        took.append((time.perf_counter() - begin, bool(found.progress)))
    curves = [1e3 * seconds for seconds, cubic in took if cubic]
    falls = [1e3 * seconds for seconds, cubic in took if not cubic]
    print(f"a cubic path: median {np.median(curves):.2f} ms, 95 % {np.percentile(curves, 95):.2f} ms;")
    print(f"  by g2 instead {np.median(falls):.2f} ms, for {len(falls) / len(took):.0%}")


def _limits() -> None:
    goals, options = _goals(1000, 7), PlanOptions(start=ORIGIN)
    print("1,000 goals, cubic method, at every millisecond: largest share of each limit")
    for law in SPEED_LAWS.names():
        worst, refused = np.zeros(4), 0
        for goal in goals:
            asked = PoseGoal(x_m=goal.x_m, y_m=goal.y_m, heading_rad=goal.heading_rad, method="cubic", law=law)
            try:
                worst = np.maximum(worst, _shares(plan_to_goal(asked, TURTLEBOT3_WAFFLE_PI, options)))
            except PlanningError:
                refused += 1
        told = ", ".join(f"{name} {share:.4f}" for name, share in zip(_SHARES, worst, strict=True))
        print(f"  {law:8} {told}; {refused} refused")


_SHARES = ("speed", "yaw rate", "wheels", "along")


def _shares(planned: Plan) -> Floats:
    """(4,) the largest share of its limit of speed, yaw rate, a wheel's speed and acceleration along the path."""
    drive, limits, speeds = TURTLEBOT3_WAFFLE_PI.drive, planned.limits, planned.speeds
    station = np.arange(0.0, speeds.station_m[-1], 1e-3 * limits.transit_speed_mps)
    speed = speeds.speed_at(station)
    ends = np.array([each.end_m for each in planned.sent])
    bent = np.array([abs(each.curve.curvature_1pm) for each in planned.sent])
    yaw = speed * bent[np.searchsorted(ends, station)]
    spins = [abs(spin.rate_radps) for spin in speeds.spins]
    yaw_most = max(float(yaw.max()), *spins) if spins else float(yaw.max())
    rim = max(float((speed + drive.half_track_m * yaw).max()), drive.half_track_m * max(spins, default=0.0))
    gain = np.abs(np.diff(np.square(speeds.speed_mps))) / (2.0 * np.diff(speeds.station_m))
    return np.array(
        (
            speed.max() / limits.transit_speed_mps,
            yaw_most / drive.max_yaw_rate_radps,
            rim / drive.max_speed_mps,
            gain.max() / limits.acceleration_mps2,
        )
    )


@kernel
def _longest_excess(goals: Floats, headings: int, found: Floats) -> float:
    """By how much (radii) a free heading's path is longer than with the best of some headings, at most."""
    word, worst = np.empty(3), -math.inf
    for i in range(len(goals)):
        for k in range(headings):
            length, _ = plain_word(goals[i, 0], goals[i, 1], 2.0 * math.pi * k / headings, 1.0, word)
            worst = max(worst, found[i, 0] - length)
    return worst


def _free_headings() -> None:
    rng = np.random.default_rng(8)
    goals = rng.uniform(-4.0, 4.0, (1_000_000, 2))
    shortest_lengths(goals[:2], 1.0)
    begin = time.perf_counter()
    found = shortest_lengths(goals, 1.0)
    took = time.perf_counter() - begin
    excess = _longest_excess(goals, 16, found)
    print(f"1,000,000 free headings in {took:.2f} s; longer than any of 16 headings by {excess:.1e} radii at most")
    gaps, word = [], np.empty(3)
    for (x, y), (length, heading) in zip(goals[:1000].tolist(), found[:1000].tolist(), strict=True):
        sampled = min(plain_word(x, y, a, 1.0, word)[0] for a in np.linspace(0.0, 2.0 * math.pi, 721))
        own = plain_word(x, y, heading, 1.0, word)[0]
        gaps.append((abs(own - length), length - min(own, sampled)))
    worst = np.max(gaps, axis=0)
    print(f"  1,000 of them: {worst[0]:.1e} off Dubins' word to their own heading, {worst[1]:.1e} over 722 headings")


def _dubins_times() -> None:
    traveller = Traveller.of(TURTLEBOT2, PlanOptions(kappa_max_1pm=1.0 / 0.3))
    turning = replace(traveller, can_reverse=False)
    pairs = list(_box_pairs(800))
    paths = [BEARING.between(*pair, traveller).path for pair in pairs]
    by_bearing = [rest_to_rest_s(path.pieces, traveller) for path in paths]
    turned = [_rest_to_rest_with_turns_s(pair, turning) for pair in pairs]
    constant = np.mean([path.length_m for path in paths]) / 0.2
    print("800 Dubins paths to the bearing in a 5 m box, R 0.3 m, at most 0.5 m/s and 0.5 m/s², mean:")
    print(f"  constant 0.2 m/s {constant:.2f} s; by limits, rest to rest {np.mean(by_bearing):.2f} s;")
    print(f"  turn on the spot and line {np.mean(turned):.2f} s")


def _box_pairs(count: int) -> Iterator[tuple[PathPose, PathPose]]:
    """From the middle of the box, heading along x, to anywhere in it."""
    rng = np.random.default_rng(9)
    for x, y in rng.uniform(-2.5, 2.5, (count, 2)).tolist():
        yield ORIGIN, PathPose(x, y, math.nan)


def _rest_to_rest_with_turns_s(pair: tuple[PathPose, PathPose], traveller: Traveller) -> float:
    return rest_to_rest_s(TURN_LINE_TURN.between(*pair, traveller).path.pieces, traveller)
