"""Mirrored queries and those that are turned round have the transitions of the query, mirrored and turned round."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from touchline.services.planner.geometry.clothoid import Floats, PathPose, Piece, PiecePath
from touchline.services.planner.steering.g2 import Steering
from touchline.services.planner.steering.method import CurveEnd

Query = tuple[CurveEnd, CurveEnd]
Transition = tuple[Piece, ...]
PAIRS = 20
LENGTH_TOLERANCE_M = 1e-9
# A shortest path is flat about its minimum: its pieces are as certain as the square root of its length, at worst.
SHAPE_TOLERANCE = 1e-5
LIMITS = ((1.125, 2.1), (1.3126, 7.0))


def mirrored_query(query: Query) -> Query:
    start, goal = (CurveEnd(PathPose(e.pose.x_m, -e.pose.y_m, -e.pose.heading_rad), -e.curvature_1pm) for e in query)
    return start, goal


def mirrored_transition(transition: Transition) -> Transition:
    return tuple(p._replace(curvature_1pm=-p.curvature_1pm, sharpness_1pm2=-p.sharpness_1pm2) for p in transition)


def turned_query(query: Query) -> Query:
    """From the goal to the start, looking the other way at both: what is driven forward still is."""
    goal, start = (
        CurveEnd(PathPose(e.pose.x_m, e.pose.y_m, e.pose.heading_rad + math.pi), -e.curvature_1pm) for e in query
    )
    return start, goal


def turned_transition(transition: Transition) -> Transition:
    return tuple(p._replace(curvature_1pm=-p.curvature_end_1pm) for p in reversed(transition))


def queries(box_m: float, share: float, curvature: float, seed: int) -> list[Query]:
    """Random pairs in a box, their curvatures up to a share of the largest."""
    rng = np.random.default_rng(seed)
    corner = (box_m, box_m, math.pi, share * curvature)
    ends = rng.uniform((0.0, 0.0, -math.pi, -share * curvature), corner, (PAIRS, 2, 4)).tolist()
    return [(CurveEnd(PathPose(*a[:3]), a[3]), CurveEnd(PathPose(*b[:3]), b[3])) for a, b in ends]


def transitions(steering: Steering, query: Query) -> list[Transition]:
    """The forward transition and those with cusps."""
    standing = [
        transition
        for transition in steering.standing_transitions(*query)
        if not any(piece.spin_rad for piece in transition)
    ]
    return [steering.between(*query), *standing]


def length(transition: Transition) -> float:
    return PiecePath(PathPose(0.0, 0.0, 0.0), transition).length_m


def table(transition: Transition) -> Floats:
    """Rows of the pieces that are long enough to tell."""
    return np.array([(p.length_m, p.curvature_1pm, p.direction) for p in transition if p.length_m > SHAPE_TOLERANCE])


FULL = ((0.5, 0.0), (2.5, 1.0), (10.0, 0.0), (10.0, 1.0))
IMAGES: tuple[tuple[Callable[[Query], Query], Callable[[Transition], Transition]], ...] = (
    (mirrored_query, mirrored_transition),
    (turned_query, turned_transition),
    (
        lambda query: mirrored_query(turned_query(query)),
        lambda transition: mirrored_transition(turned_transition(transition)),
    ),
)


@pytest.mark.parametrize(
    ("box_m", "share"),
    [(0.5, 1.0), (2.5, 0.0), *(pytest.param(*case, marks=pytest.mark.full) for case in FULL)],
)
def test_the_transitions_of_an_image_are_the_images_of_the_transitions(share: float, box_m: float) -> None:
    for limits in LIMITS:
        steering = Steering(*limits)
        for query in queries(box_m, share, limits[0], seed=3):
            found = transitions(steering, query)
            for of_query, of_transition in IMAGES:
                others = transitions(steering, of_query(query))
                assert len(found) == len(others)
                for transition, other in zip(found, others, strict=True):
                    assert length(other) == pytest.approx(length(transition), abs=LENGTH_TOLERANCE_M)
                    assert table(other) == pytest.approx(table(of_transition(transition)), abs=SHAPE_TOLERANCE)
