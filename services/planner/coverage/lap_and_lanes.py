"""Area method `lap-and-lanes`: a lap along the outline, then lanes, each turn where it costs least time and area.

Straight strokes are laid along the edges and side by side over what they leave; lanes are put into an order by time and
by what their turns cover. The way from each stroke to the next is then found by the seconds that it takes and the
square metres that only it passes over (stroke_join.py): where a stroke is left and the next one joined, whether the
machine goes on to the wall and back, and by which turns. What is missed after that is touched up as far as is asked.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import shapely

from touchline.schemas.errors import PlanningError
from touchline.services.planner.coverage.cover_stroke import CoverStroke
from touchline.services.planner.coverage.coverage_route import CoverageRoute, DriveKind, DrivePiece, one_way
from touchline.services.planner.coverage.free_space import FreeSpace
from touchline.services.planner.coverage.lane_order import LaneOrder, turn_room, word_s
from touchline.services.planner.coverage.lanes import CoverLane, lane_angle, lanes
from touchline.services.planner.coverage.laps import rings, sides
from touchline.services.planner.coverage.machine import CoverageMachine
from touchline.services.planner.coverage.reachable import reachable
from touchline.services.planner.coverage.shapes import Area, as_area
from touchline.services.planner.coverage.stroke_chain import StrokeChain
from touchline.services.planner.coverage.stroke_join import ZONE_M, Joiner
from touchline.services.planner.coverage.stroke_map import StrokeMap
from touchline.services.planner.coverage.touch_up import touched_up
from touchline.services.planner.geometry.clothoid import PathPose, PiecePath, joined

# What a square metre is worth (s): where lanes are ordered and joined, and in the corners of a lap.
LANE_S_PER_M2, LAP_S_PER_M2 = 4.0, 10.0
# While less is covered than asked for, a square metre is worth ever more.
TOUCH_UP_S_PER_M2 = (20.0, 40.0, 50.0, 60.0, 80.0, 120.0)
# The search's raster sees so much more (share of the area) than is covered: slivers narrower than a cell.
RASTER_SHARE = 1.6e-4
# A machine that does not go back closes its lap over so much (m) of its first side, to round the last corner.
CLOSING_M = 20.0
# Where there is no direct way to a stroke, so many places on others, this far apart (m), are tried to get over.
VIAS_TRIED, VIA_EVERY_M, VIA_M = 24, 8.0, 0.5


@dataclass(frozen=True)
class CoverOptions:
    """How an area is covered.

    Attributes:
        forward_only: Never backward, whatever the machine can do.
        overlap_m: By which neighbouring passes overlap at least.
        margin_m: Between the body and what it keeps off; a body that begins to turn may use up some of it.
        swath_angle_deg: Direction of the lanes, counter-clockwise from +x; None: that in which they take least.
        coverage_pct: What is missed is touched up until so much of what can be reached is covered.
    """

    forward_only: bool = False
    overlap_m: float = 0.03
    margin_m: float = 0.05
    swath_angle_deg: float | None = None
    coverage_pct: float = 99.0


def cover(
    area: shapely.Polygon,
    boundary: shapely.Polygon | None,
    obstacles: Sequence[shapely.Polygon],
    machine: CoverageMachine,
    options: CoverOptions | None = None,
) -> CoverageRoute:
    """A route that covers an area.

    Args:
        area: What is to be covered; its holes are kept off.
        boundary: The body stays inside; None: inside the area's outline.
        obstacles: The body keeps off them.
        machine: That shall cover it.
        options: How.

    Raises:
        PlanningError: The machine cannot steer, or nowhere fits into the area.
    """
    options = options or CoverOptions()
    if machine.curvature_max_1pm <= 0.0 or machine.sharpness_max_1pm2 <= 0.0:
        raise PlanningError("", "has a machine that cannot steer", "give its drive a steering angle and rate above 0")
    kept_out = [*obstacles, *(shapely.Polygon(ring) for ring in area.interiors)]
    space = FreeSpace(boundary or shapely.Polygon(area.exterior), kept_out, machine, options.margin_m)
    reach = reachable(area, space)
    covering = _Covering(area, space, reach, options) if not reach.is_empty else None
    if covering is None or not covering.lap:
        size = f"{machine.width_m:g} m wide and {machine.nose_m + machine.tail_m:g} m long"
        problem = f"has an area in which the machine ({size}) finds no room for a single straight"
        raise PlanningError("", problem, "enlarge the area, take away obstacles, or use a smaller machine")
    return covering.route()


class _Covering:
    """One area being covered."""

    def __init__(self, area: shapely.Polygon, space: FreeSpace, reach: Area, options: CoverOptions) -> None:
        machine = space.machine
        self.options, self.space, self.reach = options, space, reach
        self.reversing = machine.can_reverse and not options.forward_only
        self.covered = StrokeMap(reach, machine.width_m)
        self.joiner = Joiner(space, self.covered, LANE_S_PER_M2, reversing=self.reversing)
        self.chain = StrokeChain(self.joiner)
        target = as_area(space.free.intersection(area))
        self.lap: list[CoverStroke] = []
        self.items: list[CoverLane] = []
        for number, ring in enumerate(rings(target, machine.width_m)):
            found = sides(ring, f"lap {number + 1}" if number else "lap", space)
            if number:
                self.items += found
            else:
                self.lap = [side.along for side in found]
        rest = target.buffer(-machine.width_m, join_style="mitre", mitre_limit=3.0)
        self.angle_rad = 0.0
        if not rest.is_empty:
            pitch, asked = machine.width_m - options.overlap_m, options.swath_angle_deg
            self.angle_rad = lane_angle(rest, pitch) if asked is None else math.radians(asked)
            self.items = [*lanes(rest, self.angle_rad, pitch, space), *self.items]

    def route(self) -> CoverageRoute:
        """The finished route."""
        self._build()
        self._improve(LANE_S_PER_M2)
        self._improve(2.0 * LANE_S_PER_M2)
        self._touch_up()
        remarks = [f"{stroke.label} cannot be reached from the rest: it is left out" for stroke in self.left_out]
        return CoverageRoute(tuple(self._pieces()), self.reach, tuple(remarks))

    def _build(self) -> None:
        """Lap and lanes in order, and the first ways between them."""
        chain, strokes = self.chain, self._ordered()
        self.left_out: list[CoverStroke] = []
        for stroke in strokes:
            self._price(stroke, LANE_S_PER_M2)
            if not chain.append_over(stroke, self._vias(stroke, strokes)):
                self.left_out.append(stroke)
        chain.forget()
        self.joiner.reversing, self.joiner.seconds_per_m2 = self.reversing, TOUCH_UP_S_PER_M2[-1]
        for stroke in [*self.left_out]:
            if any(chain.insert(k, stroke) for k in range(len(chain.joins), -1, -1)):
                self.left_out.remove(stroke)

    def _ordered(self) -> list[CoverStroke]:
        """Strokes in order; the chain expects them and the turns between them."""
        chain, lap = self.chain, self.lap
        for side in lap:
            chain.expect(side, [side.part(0.0, side.length_m)])
        entries = [self._entries(side) for side in lap]
        search = LaneOrder(
            self.items,
            self.angle_rad,
            [e for each in entries for e in each],
            self.joiner,
            turn_room(self.space.machine),
        )
        for lane in self.items:
            chain.expect(lane.along, [search.part(lane.along)])
        tour = search.best()
        chain.forget()
        last = min(range(len(lap)), key=lambda k: replace(search, entries=entries[k]).entry_s(tour[0])) if tour else -1
        ring = [*lap[last + 1 :], *lap[: last + 1]]
        if not self.reversing:
            ring = [*lap[last:], *lap[:last]]
            ring.append(replace(ring[0], label="lap, closed", length_m=min(ring[0].length_m, CLOSING_M)))
        for side in ring:
            chain.expect(side, [side.part(0.0, side.length_m)])
        for stroke in tour:
            chain.expect(stroke, [search.part(stroke)])
        for before, stroke in pairwise(tour):
            chain.expect(stroke, [search.word(before, stroke)])
        return [*ring, *tour]

    def _entries(self, side: CoverStroke) -> list[PathPose]:
        """Where the way to the lanes may begin on the last side of a lap."""
        back = side.length_m - np.arange(4.0, ZONE_M, 2.0)
        at = back if self.reversing else np.arange(8.0, CLOSING_M, 2.0)
        return [side.at(s) for s in at[(at > 0.0) & (at < side.length_m)].tolist()] or [side.at(0.5 * side.length_m)]

    def _price(self, stroke: CoverStroke, lane_s: float) -> None:
        """Lanes are joined forward; a lap goes back into its corners, where that is worth more."""
        lane = stroke.kind == DriveKind.LANE and bool(self.chain.strokes) and self._last_kind == DriveKind.LANE
        self.joiner.reversing = self.reversing and not lane
        self.joiner.seconds_per_m2 = lane_s if lane else max(lane_s, LAP_S_PER_M2)

    @property
    def _last_kind(self) -> DriveKind:
        return self.chain.strokes[-1].kind

    def _vias(self, stroke: CoverStroke, strokes: list[CoverStroke]) -> Iterator[CoverStroke]:
        """Short stretches of other strokes, those on the shortest way to a stroke first."""
        chain, mover = self.chain, self.joiner.mover
        end = chain.strokes[-1].at(chain.strokes[-1].length_m)
        found = []
        for other in strokes:
            for s in np.arange(1.0, other.length_m - VIA_M, VIA_EVERY_M).tolist():
                via = CoverStroke(DriveKind.TURN, "on the way", other.at(s), VIA_M)
                around = word_s(end, via.start, mover) + word_s(via.start, stroke.start, mover)
                found.append((around, s, via))
        yield from (via for _, _, via in sorted(found, key=lambda f: f[:2])[:VIAS_TRIED])

    def _improve(self, lane_s: float, *, lanes_back: bool = False, enough_m2: float = 0.0) -> None:
        """Look at every way again, now that all others are known, while more than enough is missed."""
        for k in range(len(self.chain.joins)):
            if self.covered.missed_m2 <= enough_m2:
                return
            lane = self.chain.strokes[k].kind == self.chain.strokes[k + 1].kind == DriveKind.LANE
            self.joiner.reversing = self.reversing and (lanes_back or not lane)
            self.joiner.seconds_per_m2 = lane_s if lane else max(lane_s, LAP_S_PER_M2)
            self.chain.rejoin(k)

    def _touch_up(self) -> None:
        """Cover what is missed, the cheapest first, until it is enough."""
        headings = {
            round(stroke.start.heading_rad, 9)
            for stroke in [*self.lap, *(way for item in self.items for way in (item.along, item.back))]
        }
        share = 1.0 - 0.01 * self.options.coverage_pct - RASTER_SHARE
        enough = max(share, 0.0) * self.covered.wanted_m2
        if self.covered.missed_m2 <= enough:
            return
        for worth in TOUCH_UP_S_PER_M2:
            if self.covered.missed_m2 <= enough:
                break
            self.joiner.reversing, self.joiner.seconds_per_m2 = self.reversing, worth
            touched_up(self.chain, sorted(headings), enough)
            # What is touched up frees turns beside it of going out of their way.
            self._improve(LAP_S_PER_M2, enough_m2=enough)
            self._improve(worth, lanes_back=True, enough_m2=enough)
        for k in range(len(self.chain.joins)):
            self.joiner.reversing, self.joiner.seconds_per_m2 = self.reversing, LANE_S_PER_M2
            self.chain.rejoin(k, enough)

    def _pieces(self) -> Iterator[DrivePiece]:
        for stroke, (worked, ways) in zip(self.chain.strokes, self.chain.paths(), strict=True):
            if worked:
                yield from one_way(stroke.kind, stroke.label, worked, worked=True)
            for way in ways:
                path = PiecePath(way.start, joined(way.pieces))
                yield from one_way(DriveKind.TURN, f"{stroke.label}, turn", path, worked=False)
