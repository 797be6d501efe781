"""Chains of template segments that continue one another, in any given order and direction."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from touchline.core.near_points import near_pairs
from touchline.services.planner.swaths.offset import Stroke

# Tolerance (m, rad) within which ends meet: less than the robot's computer takes for a gap.
GAP_M, KINK_RAD = 1e-4, 5e-4


class ChainLink(NamedTuple):
    """Segment of a chain: its stroke along the chain, and back; None where it cannot be driven."""

    along: Stroke | None
    back: Stroke | None


@dataclass(frozen=True)
class Chain:
    """Segments that continue each other in at least one direction; if `closed`, the first continues the last."""

    links: tuple[ChainLink, ...]
    closed: bool = False


class End(NamedTuple):
    """End of a segment, by its number in the template: the last or the first point of its line."""

    segment: int
    last: bool

    @property
    def other(self) -> "End":
        """Other end of the segment."""
        return End(self.segment, not self.last)


def joins(first: Stroke, second: Stroke) -> bool:
    """True if one stroke continues the other: in position, heading and actuation."""
    apart, turn = second.begin.pose.seen_from(first.end.pose)
    near = abs(apart) <= GAP_M and abs(math.remainder(turn, math.tau)) <= KINK_RAD
    return near and first.actuation == second.actuation


def chains_as_given(strokes: Sequence[Stroke]) -> Iterator[Chain]:
    """Chain up strokes that are painted in this order and direction."""
    begun = 0
    for i, (first, second) in enumerate(pairwise(strokes), 1):
        if not joins(first, second):
            yield Chain(tuple(ChainLink(stroke, None) for stroke in strokes[begun:i]))
            begun = i
    yield Chain(tuple(ChainLink(stroke, None) for stroke in strokes[begun:]))


def chains(choices: Sequence[Sequence[Stroke]]) -> Iterator[Chain]:
    """Chain up segments that may be painted in any order and direction; each segment is in one chain.

    Args:
        choices: For every segment its stroke in the given direction, in the opposite one, or both.
    """
    links = [_link(choice) for choice in choices]
    mates = _mates(links)
    done: set[int] = set()
    ends = [End(i, last) for i in range(len(links)) for last in (False, True)]
    # Open chains first; the remaining ones are closed.
    for begin in [end for end in ends if end not in mates] + ends:
        if begin.segment not in done:
            walk = list(_walk(begin, mates))
            done.update(end.segment for end in walk)
            oriented = (ChainLink(*links[e.segment][::-1]) if e.last else links[e.segment] for e in walk)
            yield Chain(tuple(oriented), closed=walk[-1].other in mates)


def _link(choice: Sequence[Stroke]) -> ChainLink:
    return ChainLink(*(next((s for s in choice if s.flipped == flipped), None) for flipped in (False, True)))


def _walk(begin: End, mates: Mapping[End, End]) -> Iterator[End]:
    """Ends at which a chain's segments are entered, from `begin` to the end of the chain or once round."""
    entered: End | None = begin
    while entered:
        yield entered
        entered = mates.get(entered.other)
        if entered == begin:
            return


def _mates(links: Sequence[ChainLink]) -> dict[End, End]:
    """Match ends that continue each other; prefer the next segment, then the smallest step of curvature."""
    places, ends = [], []
    for i, link in enumerate(links):
        stroke = link.along or link.back
        assert stroke  # every segment can be painted
        x, y, _ = stroke.nozzle.end
        for last, place in ((stroke.flipped, (stroke.nozzle.x_m, stroke.nozzle.y_m)), (not stroke.flipped, (x, y))):
            ends.append(End(i, last))
            places.append(place)
    points = np.array(places).reshape(-1, 2)
    offers = []
    for a, b in ((ends[i], ends[k]) for i, k in near_pairs(points, points, GAP_M).tolist() if i < k):
        step = _step_1pm(links, a, b)
        if a.segment != b.segment and step is not None:
            offers.append((abs(a.segment - b.segment) != 1, step, min(a, b), max(a, b)))
    mates: dict[End, End] = {}
    for _, _, a, b in sorted(offers):
        if a not in mates and b not in mates:
            mates[a], mates[b] = b, a
    return mates


def _step_1pm(links: Sequence[ChainLink], a: End, b: End) -> float | None:
    """Step of curvature (1/m) between two ends; None if one does not continue the other."""
    for first, second in ((a, b), (b, a)):
        leaving, entering = links[first.segment], links[second.segment]
        out = leaving.along if first.last else leaving.back
        into = entering.back if second.last else entering.along
        if out and into and joins(out, into):
            return abs(into.robot.curvature_1pm - out.robot.curvature_1pm)
    return None
