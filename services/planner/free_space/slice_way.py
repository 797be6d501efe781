"""Ways through the tight slices themselves, for goals that straights between places of a roadmap do not reach.

In a tight polygon the body may move freely: at every heading of its slice it is free. A robot moves sideways there by
straights forward and backward at two headings, as short as the room asks for.
"""

from __future__ import annotations

import cmath
import heapq
import math
from collections import defaultdict
from dataclasses import dataclass
from itertools import count, pairwise
from typing import Final

import numpy as np
import shapely

from touchline.services.planner.free_space.legs import Legs, WalledBody
from touchline.services.planner.free_space.reachability import Portal, PoseNode, Reachability
from touchline.services.planner.geometry.clothoid import PathPose

# Price of moving sideways, per metre, in metres driven.
SIDEWAYS = 4.0
# Angles (rad) to the middle heading of a slice that are tried for straights to and fro, besides those of the slice.
SWINGS_RAD: Final = tuple(math.radians(angle) for angle in (60.0, 30.0, 12.0, 5.0))
# Largest number of times that a move is halved.
HALVINGS: Final = 14

Row = tuple[float, float, float]


@dataclass(frozen=True)
class _Move:
    """Move in a tight polygon from one position (m) to another."""

    node: PoseNode
    begin: complex
    end: complex


def way_through_slices(
    reachability: Reachability, start: PathPose, goal: PathPose, body: WalledBody, most: int
) -> Legs | None:
    """Find a way between poses for which `reachability` has proved that one exists; None if it has more straights.

    Args:
        reachability: Slices in which start and goal are joined.
        start: Start pose.
        goal: Goal pose; its heading may be NaN.
        body: The body that the slices were made for.
        most: Largest number of straights.
    """
    driven = _Driven(body, reachability, start)
    for move in _moves(reachability, start, goal):
        for begin, end in pairwise(_inside(reachability.polygon(move.node), move.begin, move.end)):
            driven.go(move.node, begin, end, HALVINGS)
        if len(driven.rows) > most:
            return None
    return body.legs(np.array(driven.rows), start, goal)


def _moves(reachability: Reachability, start: PathPose, goal: PathPose) -> list[_Move]:
    """Cheap moves from start to goal, polygon by polygon, from portal to portal."""
    goals, number = set(reachability.nodes_at(goal)), count()
    aim = complex(goal.x_m, goal.y_m)
    (first,) = reachability.nodes_at(start)
    queue: list[tuple[float, int, PoseNode, complex, int]] = [(0.0, next(number), first, complex(*start[:2]), -1)]
    steps: list[tuple[_Move, int]] = []
    done: set[object] = set()
    portals: dict[PoseNode, list[tuple[Portal, complex]]] = {}
    while queue:
        cost, _, node, at, step = heapq.heappop(queue)
        if node is _ARRIVED:
            return _traced(steps, step)
        if (node, at) in done:
            continue
        done.add((node, at))
        if node in goals:
            steps.append((_Move(node, at, aim), step))
            heapq.heappush(queue, (cost + _price(node, at, aim), next(number), _ARRIVED, aim, len(steps) - 1))
        if node not in portals:
            portals[node] = _portals(reachability, node)
        for portal, point in portals[node]:
            # A portal that the way is in already is passed where it stands.
            through = at if shapely.intersects_xy(portal.polygon, at.real, at.imag) else point
            if (portal.other, through) not in done:
                steps.append((_Move(node, at, through), step))
                priced = cost + _price(node, at, through)
                heapq.heappush(queue, (priced, next(number), portal.other, through, len(steps) - 1))
    raise AssertionError("a way that was proved to exist was not found")


_ARRIVED: Final = PoseNode((0.0, 0.0), True, -1)


def _traced(steps: list[tuple[_Move, int]], last: int) -> list[_Move]:
    moves = []
    while last >= 0:
        move, last = steps[last]
        moves.append(move)
    return moves[::-1]


def _portals(reachability: Reachability, node: PoseNode) -> list[tuple[Portal, complex]]:
    """Portals of a node, each with a point well inside it."""
    found = [each for joint in reachability.joints(node.interval) for each in joint.portals if each.node == node]
    points = [shapely.maximum_inscribed_circle(each.polygon, tolerance=_TOLERANCE_M).coords[0] for each in found]
    return [(portal, complex(*point)) for portal, point in zip(found, points, strict=True)]


_TOLERANCE_M: Final = 0.01


def _price(node: PoseNode, begin: complex, end: complex) -> float:
    """Price of a move in a slice: along its headings as driven, sideways more."""
    moved = (end - begin) * cmath.rect(1.0, -0.5 * sum(node.interval))
    return abs(moved.real) + SIDEWAYS * abs(moved.imag) + 1e-3


def _inside(polygon: shapely.Polygon, begin: complex, end: complex) -> list[complex]:
    """Points of a line inside a polygon from one point in it to another."""
    shapely.prepare(polygon)
    if _sees(polygon, begin, end):
        return [begin, end]
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(polygon))
    sides: dict[frozenset[tuple[float, float]], list[int]] = defaultdict(list)
    for k, triangle in enumerate(triangles):
        corners = [tuple(each) for each in shapely.get_coordinates(triangle)[:3].tolist()]
        for a, b in ((0, 1), (1, 2), (2, 0)):
            sides[frozenset((corners[a], corners[b]))].append(k)
    doors: dict[int, list[tuple[int, complex]]] = defaultdict(list)
    for side, both in sides.items():
        if len(both) == 2:
            middle = sum(complex(*corner) for corner in side) / 2.0
            doors[both[0]].append((both[1], middle))
            doors[both[1]].append((both[0], middle))
    first, last = (_nearest(triangles, point) for point in (begin, end))
    line = [begin, *_through(doors, first, last, begin), end]
    k = 0
    while k < len(line) - 2:  # straight ahead as far as can be seen
        j = next(j for j in range(len(line) - 1, k, -1) if j == k + 1 or _sees(polygon, line[k], line[j]))
        del line[k + 1 : j]
        k += 1
    return line


def _through(doors: dict[int, list[tuple[int, complex]]], first: int, last: int, begin: complex) -> list[complex]:
    """Middles of the sides that a short way from triangle to triangle crosses."""
    done, number = set[int](), count()
    heap: list[tuple[float, int, int, tuple[complex, ...]]] = [(0.0, next(number), first, (begin,))]
    while heap:
        cost, _, at, line = heapq.heappop(heap)
        if at == last:
            return list(line[1:])
        if at in done:
            continue
        done.add(at)
        for other, middle in doors[at]:
            if other not in done:
                heapq.heappush(heap, (cost + abs(middle - line[-1]), next(number), other, (*line, middle)))
    raise AssertionError("a polygon's triangles are not joined")


def _nearest(triangles: np.ndarray, point: complex) -> int:
    return int(np.argmin(shapely.distance(triangles, shapely.Point(point.real, point.imag))))


def _sees(polygon: shapely.Polygon, a: complex, b: complex) -> bool:
    if a == b:
        return True
    return bool(polygon.covers(shapely.LineString(((a.real, a.imag), (b.real, b.imag)))))


class _Driven:
    """Straights that carry moves out."""

    def __init__(self, body: WalledBody, reachability: Reachability, start: PathPose) -> None:
        self._body, self._reachability = body, reachability
        self._heading, self.rows = start.heading_rad, [(start.x_m, start.y_m, 1.0)]

    def go(self, node: PoseNode, begin: complex, end: complex, halvings: int) -> None:
        """Carry out a move along a line inside a tight polygon.

        By construction a move that is halved often enough is free.
        """
        if abs(end - begin) < 1e-9:
            return
        middle = 0.5 * sum(node.interval)
        for rows in self._offers(node, begin, end):
            places = np.array([(begin.real, begin.imag, 1.0), *rows])
            turns = self._body.turns(places, self._heading, middle)
            if len(turns):
                self.rows += rows
                self._heading = self._heading + float(turns[:-1].sum())
                return
        if halvings:
            half = 0.5 * (begin + end)
            self.go(node, begin, half, halvings - 1)
            self.go(node, half, end, halvings - 1)

    def _offers(self, node: PoseNode, begin: complex, end: complex) -> list[list[Row]]:
        """Straights from point to point: one, or two at headings on either side of the slice's middle."""
        low, high = node.interval
        middle, moved = 0.5 * (low + high), end - begin
        straight = [[(end.real, end.imag, sign)] for sign in _senses(moved, middle)]
        offers: list[list[Row]] = [straight[0]]
        for swing in (*SWINGS_RAD, 0.5 * (high - low)):
            for one in (swing, -swing):
                a, b = cmath.rect(1.0, middle + one), cmath.rect(1.0, middle - one)
                # The move is the sum of both, s and t long.
                cross = a.real * b.imag - a.imag * b.real
                if abs(cross) < 1e-9:
                    continue
                s = (moved.real * b.imag - moved.imag * b.real) / cross
                t = (a.real * moved.imag - a.imag * moved.real) / cross
                via = begin + s * a
                offers.append(
                    [(via.real, via.imag, math.copysign(1.0, s)), (end.real, end.imag, math.copysign(1.0, t))]
                )
        return [*offers, straight[1]]


def _senses(moved: complex, heading: float) -> tuple[float, float]:
    ahead = (moved * cmath.rect(1.0, -heading)).real
    return (1.0, -1.0) if ahead >= 0.0 else (-1.0, 1.0)
