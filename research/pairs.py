"""Random pairs of poses, and counts of the paths that a planner finds between them."""

import cmath
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from touchline.schemas.errors import PlanningError
from touchline.services.planner.geometry.clothoid import PathPose, PiecePath
from touchline.services.planner.steering.method import CurveEnd, TransitionMethod

BOX_M = 10.0
ON_GOAL = 1e-9
LIMIT_SLACK = 1e-9
SEED = 2022

Progress = Callable[[float], None]


class Pair(NamedTuple):
    """Start and goal of a path, each with its curvature (1/m)."""

    start: CurveEnd
    goal: CurveEnd


@dataclass
class Tally:
    """Counts of a planner's results on pairs.

    Attributes:
        tried, complete: Pairs, and pairs with a path.
        feasible: Paths that end on the goal (1e-9 m and rad) within κ_max, and within σ_max between steps of curvature.
        continuous: Paths without any step of curvature, their ends included.
        length_m: Their total length.
    """

    tried: int = 0
    complete: int = 0
    feasible: int = 0
    continuous: int = 0
    length_m: float = 0.0


def random_pairs(count: int, seed: int = SEED) -> Iterator[Pair]:
    """Generate poses anywhere in a 10 × 10 m square, straight at both ends, as in the study."""
    generator = np.random.default_rng(seed)
    for _ in range(count):
        x0, y0, x1, y1 = generator.uniform(0.0, BOX_M, 4).tolist()
        first, last = generator.uniform(-math.pi, math.pi, 2).tolist()
        yield Pair(CurveEnd(PathPose(x0, y0, first), 0.0), CurveEnd(PathPose(x1, y1, last), 0.0))


def close_pairs(count: int) -> Iterator[Pair]:
    """Generate poses less than 0.1 m apart with any headings; of ten, one coincides, and one but for the heading."""
    generator = np.random.default_rng(SEED)
    for k in range(count):
        x, y = generator.uniform(0.0, BOX_M, 2).tolist()
        first, last = generator.uniform(-math.pi, math.pi, 2).tolist()
        apart = cmath.rect(generator.uniform(0.0, 0.0999), generator.uniform(-math.pi, math.pi))
        if k % 10 < 2:
            apart, last = 0j, first if k % 10 == 0 else last
        yield Pair(CurveEnd(PathPose(x, y, first), 0.0), CurveEnd(PathPose(x + apart.real, y + apart.imag, last), 0.0))


def joints(count: int, curvatures_1pm: Sequence[float], seed: int = SEED) -> Iterator[Pair]:
    """Generate `count` random pairs for every two curvatures: line to line, line to arc, arc to line, arc to arc."""
    for k_from in curvatures_1pm:
        for k_to in curvatures_1pm:
            for start, goal in random_pairs(count, seed):
                yield Pair(start._replace(curvature_1pm=k_from), goal._replace(curvature_1pm=k_to))


def tally(
    method: TransitionMethod,
    pairs: Iterator[Pair],
    total: int,
    kappa_1pm: float,
    sigma_1pm2: float,
    step: Progress = lambda fraction: None,
) -> Tally:
    """Count the results of `method` on `pairs`; `step` is called with the fraction of `total` that is done.

    Args:
        method: Transition method.
        pairs: Pairs of poses.
        total: Number of pairs.
        kappa_1pm: Maximum curvature of feasible paths.
        sigma_1pm2: Maximum sharpness of feasible paths.
        step: Called with the fraction done.
    """
    result = Tally()
    for start, goal in pairs:
        result.tried += 1
        if result.tried % 100 == 0:
            step(result.tried / total)
        try:
            path = PiecePath(start.pose, method.between(start, goal))
        except PlanningError:
            continue
        result.complete += 1
        result.length_m += path.length_m
        result.feasible += _feasible(path, goal, kappa_1pm, sigma_1pm2)
        result.continuous += _continuous(path, start, goal)
    return result


def _feasible(path: PiecePath, goal: CurveEnd, kappa_1pm: float, sigma_1pm2: float) -> bool:
    end = path.end
    off = max(abs(end.point - goal.pose.point), abs(cmath.phase(end.direction / goal.pose.direction)))
    curvature = max((max(abs(p.curvature_1pm), abs(p.curvature_end_1pm)) for p in path.pieces), default=0.0)
    sharpness = max((abs(p.sharpness_1pm2) for p in path.pieces), default=0.0)
    return off <= ON_GOAL and curvature <= kappa_1pm + LIMIT_SLACK and sharpness <= sigma_1pm2 + LIMIT_SLACK


def _continuous(path: PiecePath, start: CurveEnd, goal: CurveEnd) -> bool:
    curvature = start.curvature_1pm
    for piece in path.pieces:
        if abs(piece.curvature_1pm - curvature) > LIMIT_SLACK:
            return False
        curvature = piece.curvature_end_1pm
    return abs(curvature - goal.curvature_1pm) <= LIMIT_SLACK
