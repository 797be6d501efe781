"""The stretch of a path that a robot claims: where it lies, and what is told of several when one drives on."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from touchline.jobs.shared.claimed_stretch import (
    PUBLISH_EVERY_S,
    SAGITTA_M,
    ClaimedStretch,
    publish_stretches,
    stretch_poses,
)
from touchline.onboard.trajectory.path import cut_path
from touchline.schemas.curves import Curve
from touchline.schemas.messages import LinearDirection
from touchline.schemas.trajectories import segment, turn
from touchline.schemas.vehicles import Vehicle

DENSE_M = 0.01
LENGTHS = st.floats(0.02, 30.0)
PIECES = st.lists(
    st.one_of(
        st.tuples(st.just("drive"), LENGTHS, st.one_of(st.just(0.0), st.floats(-2.0, 2.0)), st.booleans()),
        st.tuples(st.just("turn"), st.floats(-2.0 * math.pi, 2.0 * math.pi)),
    ),
    min_size=1,
    max_size=8,
).filter(lambda pieces: any(piece[0] == "drive" for piece in pieces))


class Way:
    """A path of lines, arcs and turns on the spot, one after the other, driven forward or backward."""

    def __init__(self, pieces):
        x, y, heading, length_m = 3.0, -2.0, 0.4, 0.0
        self.segments, self.curves = [], []
        for number, (kind, size, *more) in enumerate(pieces):
            if kind == "turn":
                self.segments.append(turn(f"s{number}", x, y, size))
                heading += size
                continue
            bend, backward = more
            # less than once round, so that it has one end
            curve = Curve(x, y, heading + math.pi * backward, bend, min(size, 6.0 / abs(bend)) if bend else size)
            direction = LinearDirection.BACKWARD if backward else LinearDirection.FORWARD
            self.segments.append(segment(f"s{number}", curve, direction))
            self.curves.append((length_m, curve))
            length_m += curve.length_m
            x, y, tangent = curve.end
            heading = tangent - math.pi * backward
        self.length_m = length_m

    def places(self, from_m, to_m):
        """(n, 2) places between two arc lengths, close to each other, both ends among them."""
        found = []
        for begins_m, curve in self.curves:
            first_m, last_m = max(from_m - begins_m, 0.0), min(to_m - begins_m, curve.length_m)
            if first_m <= last_m:
                along_m = np.linspace(first_m, last_m, 2 + int((last_m - first_m) / DENSE_M))
                found.append(np.column_stack(curve.at(along_m)[:2]))
        return np.concatenate(found)

    def stretch(self, from_m, to_m):
        rows, legs = cut_path(tuple(self.segments), Vehicle())
        turns_rad = np.zeros(len(rows))
        for leg in legs:
            turns_rad[leg.first] = leg.turn_rad
        return stretch_poses(rows, turns_rad, from_m, to_m)


@given(PIECES, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_stretch_lies_on_the_path_from_one_place_to_the_other(pieces, one, other):
    way = Way(pieces)
    from_m, to_m = sorted((one * way.length_m, other * way.length_m))
    poses = way.stretch(from_m, to_m)
    if from_m == to_m:
        assert poses.shape == (0, 3)
        return
    places = way.places(from_m, to_m)
    assert poses[0, :2] == pytest.approx(places[0], abs=1e-6)
    assert poses[-1, :2] == pytest.approx(places[-1], abs=1e-6)
    assert shapely.distance(shapely.LineString(places), shapely.points(poses[:, :2])).max() < 1e-3
    assert shapely.distance(shapely.LineString(poses[:, :2]), shapely.points(places)).max() <= SAGITTA_M + 1e-6
    assert np.hypot(*np.diff(poses[:, :2], axis=0).T).sum() <= to_m - from_m + 1e-6


def test_what_is_straight_has_its_ends_alone_and_faces_as_the_robot_does():
    straight = ("drive", 40.0, 0.0, False)
    assert len(Way([straight] * 3).stretch(1.0, 119.0)) == 2
    there_and_back = Way([straight, ("drive", 10.0, 0.0, True), ("turn", math.pi)]).stretch(0.0, 50.0)
    assert there_and_back[:, 2] == pytest.approx([0.4, 0.4, 0.4, 0.4 + math.pi / 2, 0.4 + math.pi])
    assert math.dist(there_and_back[0, :2], there_and_back[-1, :2]) == pytest.approx(30.0)
    circle = Way([("drive", 2.0 * math.pi * 9.15 * 0.9, 1.0 / 9.15, False)])
    assert 20 < len(circle.stretch(0.0, circle.length_m)) < 40


class Robot:
    """Drives straight ahead; what it tells goes to a list that several have in common."""

    def __init__(self, name, said):
        self.stretch = ClaimedStretch(lambda path: said.append((name, [each.pose.position.x for each in path.poses])))
        self.stretch.take((segment("a", Curve(0.0, 0.0, 0.0, 0.0, 100.0)),), Vehicle())


def test_what_is_passed_is_told_before_what_others_are_granted_for_it_and_else_now_and_then():
    said = []
    robots = [Robot(name, said) for name in "ab"]
    first, second = (robot.stretch for robot in robots)

    def told(now_s, **claims):
        for name, (from_m, to_m) in claims.items():
            {"a": first, "b": second}[name].claim(from_m, to_m)
        said.clear()
        publish_stretches([first, second], now_s)
        return said

    assert told(0.0, a=(0.0, 100.0), b=(0.0, 10.0)) == [("a", [0.0, 100.0]), ("b", [0.0, 10.0])]
    assert told(1.0, a=(5.0, 100.0)) == []
    assert told(PUBLISH_EVERY_S) == [("a", [5.0, 100.0])]
    assert told(2.5, a=(6.0, 100.0), b=(1.0, 20.0)) == [("a", [6.0, 100.0]), ("b", [1.0, 10.0]), ("b", [1.0, 20.0])]
    assert told(2.6, b=(1.0, 15.0)) == [("b", [1.0, 15.0])], "what is granted no more, at once"
    assert told(2.7, a=(100.0, 100.0)) == [("a", [])]
    assert told(9.0) == []
    first.take((segment("a", Curve(0.0, 0.0, 0.0, 0.0, 7.0)),), Vehicle())
    assert told(9.1, a=(0.0, 7.0)) == [("a", [0.0, 7.0])]
    said.clear()
    for _ in range(2):
        for robot in robots:
            robot.stretch.release()
    assert said == [("a", []), ("b", [])]
