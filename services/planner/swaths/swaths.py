"""Swaths: template segments, one or several that continue each other, painted without a break.

Where segments join, heading is continuous, but curvature may step. A robot cannot follow a step: over a stretch of
length L about the joint κ changes linearly. After it the heading is right, and the robot is off the line by Δκ·L²/24,
the double integral of the error of κ. `JOINT_OFFSET_M` of that is allowed. The wheels have to follow the sharpness
Δκ/L, which limits the speed.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice, pairwise

import numpy as np

from touchline.core.plain_sum import plain_sum
from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.geometry.clothoid import Floats, PathPose, Piece, PiecePath
from touchline.services.planner.limits import Limits
from touchline.services.planner.method_traits import MethodTraits, method_as
from touchline.services.planner.steering.method import CurveEnd, before
from touchline.services.planner.swaths.chains import Chain, ChainLink, chains, chains_as_given, joins
from touchline.services.planner.swaths.offset import CIRCLE_STARTS, Stroke

# Maximum offset (m) from the line where two segments of different curvature join.
JOINT_OFFSET_M = 0.003
# A joint that has to be passed more slowly than this (m/s) is not joined.
JOINT_SPEED_MIN_MPS = 0.1
# Time (s) to leave a line and return to it: a swath that is slowed down by more is divided.
PARTING_S = 8.0
# A longer swath (m) is ordered in parts, so that other lines may come in between. Consecutive parts are still painted
# without a break.
LONG_M = 60.0
# Maximum number of modes, as every pair is timed; with more, closed lines get fewer start points.
MODES_MAX = 4000
# A line is painted so slowly that the valve is open for this multiple of its minimum time.
VALVE_SPARE = 2.0
# Curvatures that differ by less (1/m), and pieces that are shorter (m), are rounding.
STEP_1PM, PIECE_M = 1e-9, 1e-9


@dataclass(frozen=True)
class Swath:
    """Segments that are painted without a break and at one speed.

    Attributes:
        strokes: Strokes in the order and direction of travel.
        paths: Path of the robot along each, continuous in curvature from stroke to stroke.
        speed_mps: Speed of painting, m/s.
    """

    strokes: tuple[Stroke, ...]
    paths: tuple[PiecePath, ...]
    speed_mps: float

    @property
    def begin(self) -> CurveEnd:
        """Robot pose, curvature and speed at the beginning of painting."""
        return self.strokes[0].begin._replace(speed_mps=self.speed_mps)

    @property
    def end(self) -> CurveEnd:
        """Robot pose, curvature and speed at the end of painting."""
        return self.strokes[-1].end._replace(speed_mps=self.speed_mps)

    @property
    def length_m(self) -> float:
        """Length of the robot's path (m)."""
        return plain_sum(path.length_m for path in self.paths)

    @property
    def seconds(self) -> float:
        """Time of painting (s)."""
        return self.length_m / self.speed_mps


@dataclass(frozen=True)
class Painting:
    """Speeds at which strokes and joints can be painted.

    Attributes:
        limits: Limits of the plan.
        joining: Whether strokes that continue each other are painted without a break.
        sharpness_max_1pm2: Maximum sharpness of the robot's path at a joint, 1/m².
        valve_s: Excess of the valve's closing delay over its opening delay, s: the minimum time that it is open.
    """

    limits: Limits
    joining: bool = True
    sharpness_max_1pm2: float = math.inf
    valve_s: float = 0.0

    @classmethod
    def of(cls, vehicle: Vehicle, limits: Limits, options: PlanOptions) -> "Painting":
        """Derive the speeds from the limits of a plan and the sharpness in its options.

        A method may forbid joining: `dubins-padded` puts its padding around every segment.
        """
        valve_s = max(vehicle.tool.closes_s - vehicle.tool.opens_s, 0.0)
        return cls(limits, method_as(MethodTraits, options).joins, options.sigma_max_1pm2 or math.inf, valve_s)

    def stroke_mps(self, stroke: Stroke) -> float:
        """Speed (m/s) along one stroke."""
        return self.limits.steady_speed_mps(stroke.robot.curvature_1pm)

    def joint_mps(self, first: Stroke, second: Stroke) -> float:
        """Speed (m/s) from one stroke into the other; 0 if it is too slow or they do not join."""
        if not (self.joining and joins(first, second)):
            return 0.0
        bends = abs(first.robot.curvature_1pm), abs(second.robot.curvature_1pm)
        half = half_ramp_m(first, second)
        sharpness = _step_1pm(first, second) / (2.0 * half) if half else 0.0
        speed = self.limits.steady_speed_mps(max(bends), sharpness)
        return speed if speed >= JOINT_SPEED_MIN_MPS and sharpness <= self.sharpness_max_1pm2 else 0.0

    def in_one_go(self, first: Swath, second: Swath) -> Swath | None:
        """Merge two swaths, if the first continues into the second."""
        if not self.joint_mps(first.strokes[-1], second.strokes[0]):
            return None
        return self.swath((*first.strokes, *second.strokes))

    def swath(self, strokes: Sequence[Stroke]) -> Swath:
        """Create the swath of strokes that continue each other."""
        halves = [0.0, *(half_ramp_m(a, b) for a, b in pairwise(strokes)), 0.0]
        bends = [stroke.robot.curvature_1pm for stroke in strokes]
        middles = [bends[0], *(0.5 * (a + b) for a, b in pairwise(bends)), bends[-1]]
        paths = []
        for k, stroke in enumerate(strokes):
            pieces = tuple(_pieces(stroke.robot.length_m, halves[k : k + 2], middles[k], bends[k], middles[k + 1]))
            begin = stroke.begin.pose
            if halves[k]:
                # After the joint the path is on the stroke again.
                x, y, heading, _ = stroke.robot.at(halves[k])
                begin = before(PathPose(float(x), float(y), float(heading)), pieces[:1])
            paths.append(PiecePath(begin, pieces))
        length = plain_sum(stroke.robot.length_m for stroke in strokes)
        speeds = [*map(self.stroke_mps, strokes), *(self.joint_mps(a, b) for a, b in pairwise(strokes))]
        if self.valve_s:
            speeds.append(length / (VALVE_SPARE * self.valve_s))
        return Swath(tuple(strokes), tuple(paths), min(speeds))


def parted(wholes: Sequence[Swath], swaths: Sequence[Swath]) -> list[Swath]:
    """Give `swaths` the paths and speeds of `wholes`, each of which joins one or more of them in their order."""
    paths = iter([(path, whole.speed_mps) for whole in wholes for path in whole.paths])
    found = []
    for swath in swaths:
        own, speeds = zip(*islice(paths, len(swath.strokes)), strict=True)
        found.append(replace(swath, paths=own, speed_mps=speeds[0]))
    return found


def half_ramp_m(first: Stroke, second: Stroke) -> float:
    """Half the length (m) of the stretch over which curvature changes, up to the middles of the strokes."""
    step = _step_1pm(first, second)
    if step <= STEP_1PM:
        return 0.0
    return 0.5 * min(math.sqrt(24.0 * JOINT_OFFSET_M / step), first.robot.length_m, second.robot.length_m)


def _step_1pm(first: Stroke, second: Stroke) -> float:
    return abs(second.robot.curvature_1pm - first.robot.curvature_1pm)


def _pieces(length: float, halves: Sequence[float], ahead: float, bend: float, behind: float) -> Iterator[Piece]:
    """Pieces from curvature `ahead` to `bend` over the first of the `halves` (m), then to `behind` over the second."""
    first, last = halves
    if first:
        yield Piece(first, ahead, (bend - ahead) / first)
    if length - first - last > PIECE_M:
        yield Piece(length - first - last, bend)
    if last:
        yield Piece(last, bend, (behind - bend) / last)


def swaths(choices: Sequence[Sequence[Stroke]], painting: Painting, *, free: bool) -> list[list[Swath]]:
    """List the modes of every swath, in the order of their first segments.

    Args:
        choices: Modes of every segment, from `offset.modes`.
        painting: Speeds of painting.
        free: Whether order and direction are free; otherwise they are as given, each segment in its first mode.
    """
    if not free:
        given = chains_as_given([choice[0] for choice in choices])
        return [modes for chain in given for modes in _swaths_of(chain, painting)]
    # Circles that may begin anywhere have many modes and continue nothing.
    found = [[painting.swath([stroke]) for stroke in choice] for choice in choices if len(choice) > 2]
    for chain in chains([choice for choice in choices if len(choice) <= 2]):
        found += _swaths_of(chain, painting)
    place = {choice[0].id: i for i, choice in enumerate(choices)}
    found.sort(key=lambda modes: min(place[stroke.id] for stroke in modes[0].strokes))
    if sum(map(len, found)) > MODES_MAX:
        return [_fewer(modes, max(MODES_MAX // (2 * len(found)), 1)) for modes in found]
    return found


def _fewer(modes: Sequence[Swath], most: int) -> list[Swath]:
    """Limit the modes of a closed line to `most` start points; other lines keep both modes."""
    begun = [(round(mode.strokes[0].nozzle.x_m, 6), round(mode.strokes[0].nozzle.y_m, 6)) for mode in modes]
    places = list(dict.fromkeys(begun))
    if len(modes) <= 2 or len(places) <= most:
        return [*modes]
    kept = places[:: -(-len(places) // most)]
    return [mode for mode, place in zip(modes, begun, strict=True) if place in kept]


def _swaths_of(chain: Chain, painting: Painting) -> Iterator[list[Swath]]:
    """Divide a chain into the parts that take the least time; return the modes of each part."""
    links = chain.links
    strokes, joints = _speeds(chain, painting)
    if chain.closed:
        # If it is divided anywhere, then at the slowest joint.
        turn = 1 + int(np.argmin(joints.max(axis=0)))
        links, strokes, joints = _turned(links, turn), np.roll(strokes, -turn, axis=1), np.roll(joints, -turn, axis=1)
    lengths = np.array([next(s.nozzle.length_m for s in link if s) for link in links])
    for first, last in _short(_parts(lengths, strokes, joints), lengths):
        part = links[first:last]
        starts = min(len(part), CIRCLE_STARTS) if len(part) == len(links) and joints[:, -1].any() else 1
        begun = [_turned(part, k * len(part) // starts) for k in range(starts)]
        yield [swath for each in begun for swath in _both_directions(each, painting)]


def _turned(links: tuple[ChainLink, ...], count: int) -> tuple[ChainLink, ...]:
    """Rotate the links of a closed chain by `count`."""
    return (*links[count:], *links[:count])


def _speeds(chain: Chain, painting: Painting) -> tuple[Floats, Floats]:
    """Speed (m/s) of each link, and from each into the next, (2, links): along the chain, and back; 0: impossible."""
    following = [*chain.links[1:], chain.links[0] if chain.closed else ChainLink(None, None)]
    strokes = [[painting.stroke_mps(stroke) if stroke else 0.0 for stroke in link] for link in chain.links]
    joints = [
        (
            painting.joint_mps(link.along, after.along) if link.along and after.along else 0.0,
            painting.joint_mps(after.back, link.back) if link.back and after.back else 0.0,
        )
        for link, after in zip(chain.links, following, strict=True)
    ]
    return np.array(strokes).T, np.array(joints).T


def _parts(length_m: Floats, strokes_mps: Floats, joints_mps: Floats) -> list[tuple[int, int]]:
    """Optimal parts [first, last) of a chain, where each part takes `PARTING_S` besides, by dynamic programming."""
    count = len(length_m)
    reached = np.concatenate(([0.0], np.cumsum(length_m)))
    least, first = np.zeros(count + 1), np.zeros(count + 1, dtype=np.int64)
    speeds = np.zeros((2, count))
    for last in range(count):
        # Speeds of the parts that end here, by their beginning.
        speeds[:, last] = np.inf
        if last:
            np.minimum(speeds[:, :last], joints_mps[:, last - 1, None], out=speeds[:, :last])
        np.minimum(speeds[:, : last + 1], strokes_mps[:, last, None], out=speeds[:, : last + 1])
        best = np.maximum(speeds[:, : last + 1].max(axis=0), 1e-9)
        seconds = least[: last + 1] + (reached[last + 1] - reached[: last + 1]) / best + PARTING_S
        first[last + 1] = np.argmin(seconds)
        least[last + 1] = seconds[first[last + 1]]
    parts, last = [], count
    while last:
        parts.append((int(first[last]), last))
        last = int(first[last])
    return parts[::-1]


def _short(parts: Sequence[tuple[int, int]], length_m: Floats) -> Iterator[tuple[int, int]]:
    """Divide parts longer than `LONG_M` at joints."""
    for first, last in parts:
        begun, length = first, 0.0
        for i in range(first, last):
            if i > begun and length + length_m[i] > LONG_M:
                yield begun, i
                begun, length = i, 0.0
            length += float(length_m[i])
        yield begun, last


def _both_directions(links: Sequence[ChainLink], painting: Painting) -> Iterator[Swath]:
    """Swaths along links and back, as far as they are painted without a break."""
    for given in ([link.along for link in links], [link.back for link in links[::-1]]):
        strokes = [stroke for stroke in given if stroke]
        if len(strokes) == len(given) and all(painting.joint_mps(a, b) for a, b in pairwise(strokes)):
            yield painting.swath(strokes)
