"""Proof that a way of a body from pose to pose exists, or that none does.

A vehicle that drives forward and backward with bounded curvature, or turns on the spot, follows any path of a freely
moving body with clearance arbitrarily closely (Laumond, Jacobs, Taix and Murray, "A motion planner for nonholonomic
mobile robots", IEEE Transactions on Robotics and Automation 10(5), 1994). So a way exists exactly if both poses are in
one component of the free poses. Heading slices bracket the components: joined by tight brackets, a way exists; not
joined by loose ones, none does. Where only loose brackets join, slices are halved.
"""

from __future__ import annotations

import heapq
import math
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from itertools import count
from typing import Final, NamedTuple

import numpy as np
import shapely

from touchline.core.robust_overlay import as_area, intersections
from touchline.services.planner.free_space.slices import HeadingSlice, Interval, Parts, Slicer
from touchline.services.planner.geometry.clothoid import PathPose

SLICES: Final = 24
"""Slices before any is halved."""
FINEST_RAD: Final = math.radians(1.0)
"""Slices up to this width are not halved,"""
FINEST_AT_ENDS_RAD: Final = FINEST_RAD / 16.0
"""and those of the headings of start and goal up to this one, as a robot may stand close to a wall."""
# Cost of a doubtful step between slices that are not halved, in steps of which one is.
STUCK: Final = 1e4


class Proof(Enum):
    """Result of a proof."""

    EXISTS = "exists"
    NONE = "none"
    UNDECIDED = "undecided"


class PoseNode(NamedTuple):
    """A polygon of a slice: its interval, whether it is one of the tight ones, and its number there."""

    interval: Interval
    tight: bool
    number: int

    def loosely(self, sliced: HeadingSlice) -> PoseNode:
        """PoseNode of the loose polygon that it lies in, or is."""
        return PoseNode(self.interval, False, int(sliced.within[self.number])) if self.tight else self


class Portal(NamedTuple):
    """Positions at which a way passes from one tight node to another, at the heading of both."""

    node: PoseNode
    other: PoseNode
    polygon: shapely.Polygon


@dataclass(frozen=True)
class Joint:
    """Nodes of two slices that meet at a heading of both: tight ones by portals, loose ones by index."""

    portals: list[Portal]
    loose: list[tuple[int, int]]


class Reachability:
    """Free poses of a body on a ground, by heading slices that become finer where a question asks for it."""

    def __init__(self, slicer: Slicer) -> None:
        """Take the slicer; slices are made when they are asked for."""
        self._slicer = slicer
        width = math.tau / SLICES
        self._intervals = [(number * width, (number + 1) * width) for number in range(SLICES)]
        self._ends: list[float] = []
        self._slices: dict[Interval, HeadingSlice] = {}
        self._joints: dict[tuple[Interval, Interval], Joint] = {}

    def prove(self, start: PathPose, goal: PathPose) -> Proof:
        """Prove that there is a way from a start to a goal, whose heading may be NaN for any, or that there is none."""
        self._ends = [pose.heading_rad % math.tau for pose in (start, goal) if not math.isnan(pose.heading_rad)]
        while True:
            doubtful = self._least_doubtful(start, goal)
            if doubtful is None:
                return Proof.NONE
            if not doubtful:
                return Proof.EXISTS
            wide = {each for each in doubtful if self._wide(each)}
            if not wide:
                return Proof.UNDECIDED
            for interval in wide:
                self._halve(interval)

    def nodes_at(self, pose: PathPose) -> list[PoseNode]:
        """Tight node of a pose, else the loose one; with heading NaN those of all slices."""
        if math.isnan(pose.heading_rad):
            return [node for interval in self._intervals for node in self._at(interval, pose)]
        heading = pose.heading_rad % math.tau
        return self._at(self._intervals[bisect_right(self._intervals, (heading, math.inf)) - 1], pose)

    def reached_loosely(self, pose: PathPose) -> dict[Interval, list[shapely.Polygon]]:
        """Loose polygons that a pose of the question is joined with, by interval."""
        sliced = self.nodes_at(pose)
        waiting = [node.loosely(self.slice(node.interval)) for node in sliced]
        found = set(waiting)
        while waiting:
            new = {each for each in self._steps(waiting.pop()) if not each.tight} - found
            found |= new
            waiting += new
        reached: dict[Interval, list[shapely.Polygon]] = {}
        for interval, _, index in found:
            reached.setdefault(interval, []).append(self.slice(interval).loose[index])
        return reached

    def slice(self, interval: Interval) -> HeadingSlice:
        """Return the slice of an interval."""
        if interval not in self._slices:
            self._slices[interval] = self._slicer.slice(interval)
        return self._slices[interval]

    def polygon(self, node: PoseNode) -> shapely.Polygon:
        """Return the polygon of a node."""
        sliced = self.slice(node.interval)
        found: shapely.Polygon = (sliced.tight if node.tight else sliced.loose)[node.number]
        return found

    def joints(self, interval: Interval) -> Iterator[Joint]:
        """Joints of a slice with those that it shares a heading with; the slice is the first of each joint."""
        for other in self._neighbours(interval):
            if (interval, other) not in self._joints:
                self._joints[interval, other] = _joint(self.slice(interval), self.slice(other))
            yield self._joints[interval, other]

    def _neighbours(self, interval: Interval) -> list[Interval]:
        """Intervals that share a heading with an interval."""
        at = bisect_right(self._intervals, (interval[0], math.inf)) - 1
        return [self._intervals[at - 1], self._intervals[at + 1 - len(self._intervals)]]

    def _at(self, interval: Interval, pose: PathPose) -> list[PoseNode]:
        sliced, point = self.slice(interval), shapely.Point(pose.x_m, pose.y_m)
        for tight, parts in ((True, sliced.tight), (False, sliced.loose)):
            found = np.flatnonzero(shapely.intersects(parts, point))
            if len(found):
                return [PoseNode(interval, tight, int(found[0]))]
        return []

    def _least_doubtful(self, start: PathPose, goal: PathPose) -> list[Interval] | None:
        """Slices of the doubtful steps of a way that has the fewest; None if there is no way."""
        goals, number = set(self.nodes_at(goal)), count()
        queue: list[tuple[float, int, PoseNode, PoseNode | None]] = [
            (0.0, next(number), node, None) for node in self.nodes_at(start)
        ]
        before: dict[PoseNode, PoseNode | None] = {}
        while queue:
            cost, _, node, previous = heapq.heappop(queue)
            if node in before:
                continue
            before[node] = previous
            if node in goals:
                return _doubtful(node, before)
            for following in self._steps(node):
                if following not in before:
                    heapq.heappush(queue, (cost + self._cost(node, following), next(number), following, node))
        return None

    def _steps(self, node: PoseNode) -> Iterator[PoseNode]:
        """Nodes that one can be left for."""
        sliced = self.slice(node.interval)
        if node.tight:
            yield node.loosely(sliced)
            for joint in self.joints(node.interval):
                yield from (portal.other for portal in joint.portals if portal.node == node)
            return
        yield from (PoseNode(node.interval, True, int(index)) for index in np.flatnonzero(sliced.within == node.number))
        for other, joint in zip(self._neighbours(node.interval), self.joints(node.interval), strict=True):
            yield from (PoseNode(other, False, second) for first, second in joint.loose if first == node.number)

    def _cost(self, node: PoseNode, following: PoseNode) -> float:
        """Cost of a step: 0 if it is certain."""
        if node.tight and following.tight:
            return 0.0
        return 1.0 if self._wide(node.interval) or self._wide(following.interval) else STUCK

    def _wide(self, interval: Interval) -> bool:
        low, high = interval
        at_end = any(low <= each <= high for each in self._ends)
        return high - low > (FINEST_AT_ENDS_RAD if at_end else FINEST_RAD)

    def _halve(self, interval: Interval) -> None:
        (low, high), at = interval, self._intervals.index(interval)
        middle = 0.5 * (low + high)
        self._intervals[at : at + 1] = [(low, middle), (middle, high)]
        self._joints = {pair: joint for pair, joint in self._joints.items() if interval not in pair}
        del self._slices[interval]


def _doubtful(node: PoseNode | None, before: dict[PoseNode, PoseNode | None]) -> list[Interval]:
    """Intervals of the loose nodes of a way, which ends at a node."""
    found = []
    while node is not None:
        previous = before[node]
        if previous is not None and not (node.tight and previous.tight):
            found += [node.interval, previous.interval]
        elif previous is None and not node.tight:
            found.append(node.interval)
        node = previous
    return found


def _joint(first: HeadingSlice, second: HeadingSlice) -> Joint:
    a, b = _meeting(first.tight, second.tight)
    common = intersections(first.tight[a], second.tight[b]) if len(a) else np.empty(0, object)
    portals = [
        Portal(PoseNode(first.interval, True, int(i)), PoseNode(second.interval, True, int(j)), part)
        for i, j, shape in zip(a, b, common, strict=True)
        for part in shapely.get_parts(as_area(shape))
        if part.area > 0.0
    ]
    return Joint(portals, [(int(i), int(j)) for i, j in zip(*_meeting(first.loose, second.loose), strict=True)])


def _meeting(first: Parts, second: Parts) -> tuple[np.ndarray, np.ndarray]:
    """Indices of polygons that meet, in pairs."""
    found = shapely.STRtree(second).query(first, predicate="intersects")
    return found[0], found[1]
