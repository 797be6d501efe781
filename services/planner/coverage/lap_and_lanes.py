"""Area method `lap-and-lanes`: a lap along the outline, then lanes, each turn where it costs least time and area.

Straight strokes are laid along the edges (laps) and side by side inside them (lanes); lanes are ordered by time and by
what their turns cover. The transition from each stroke to the next is then chosen by the seconds that it takes and the
square metres that only it covers (stroke_transition.py): where one stroke is left and the next one joined, whether the
machine drives on to the wall and back, and by which turns. What is missed then is touched up, as far as asked.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from touchline.core.plain_sum import plain_sum
from touchline.core.robust_overlay import as_area, buffer, intersection
from touchline.core.tool_reach import reachable
from touchline.schemas.errors import PlanningError
from touchline.services.planner.coverage.cover_stroke import CoverStroke
from touchline.services.planner.coverage.coverage_raster import CoverageRaster
from touchline.services.planner.coverage.coverage_route import CoverageRoute, DriveKind, DrivePiece, split_at_cusps
from touchline.services.planner.coverage.coverage_task import CoverageTask
from touchline.services.planner.coverage.free_space import FreeSpace
from touchline.services.planner.coverage.kernels.turn_pieces import words_s
from touchline.services.planner.coverage.lane_order import LaneOrder, turn_room
from touchline.services.planner.coverage.lanes import CoverLane, lane_angle, lanes
from touchline.services.planner.coverage.laps import rings, sides
from touchline.services.planner.coverage.setting_out import departures, set_out
from touchline.services.planner.coverage.shapes import Area
from touchline.services.planner.coverage.stroke_chain import StrokeChain
from touchline.services.planner.coverage.stroke_transition import ZONE_M, TransitionFinder
from touchline.services.planner.coverage.touch_up import places, touched_up
from touchline.services.planner.geometry.clothoid import PathPose, PiecePath, joined

# Price of an uncovered square metre (s): where lanes are ordered and joined, and in the corners of a lap.
LANE_S_PER_M2, LAP_S_PER_M2 = 4.0, 10.0
# Rising prices while the coverage is below what is asked.
TOUCH_UP_S_PER_M2 = (20.0, 40.0, 50.0, 60.0, 80.0, 120.0)
# Share of the area by which the raster overestimates the coverage: slivers narrower than a cell.
RASTER_SHARE = 1.6e-4
# A machine that does not reverse closes its lap over this length (m) of the first side, to round the last corner.
CLOSING_M = 20.0
# Via strokes where no transition leads to a stroke directly: number, spacing on other strokes and length (m).
VIAS_TRIED, VIA_EVERY_M, VIA_M = 24, 8.0, 0.5
# Where strokes out of reach lose more than this share of the area, this many others are tried as the first.
LOST_SHARE, STARTS_TRIED = 0.01, 6
# With many strokes fewer starts are tried: at most this many strokes are joined again, but at least one start.
STROKES_ANEW = 40
# A stroke out of reach is tried after this many others, the nearest first.
INSERTS_TRIED = 12
# Smaller areas (m²) behind narrow passages are not mentioned.
BEYOND_MIN_M2 = 0.05
# Progress when strokes are ordered, joined, and improved (share of the time).
ORDERED, JOINED, IMPROVED = 0.2, 0.4, 0.7


def _beside(space: FreeSpace) -> Area:
    """Ground that the tool reaches along straight walls: a body wider than the tool keeps it off."""
    machine = space.machine
    apart_m = machine.beside_m - 0.5 * machine.width_m
    return as_area(buffer(space.free, -apart_m, join_style="mitre")) if apart_m > 0.0 else space.free


def cover(task: CoverageTask, progress: Callable[[float], None] = lambda done: None) -> CoverageRoute:
    """Plan a route that covers an area.

    Args:
        task: Area, ground, machine and options.
        progress: Called with the fraction done; may raise to end the search.

    Raises:
        PlanningError: The machine cannot steer, or has no room for a straight.
    """
    area, machine = task.wanted, task.machine
    if machine.curvature_max_1pm <= 0.0 or machine.sharpness_max_1pm2 <= 0.0:
        raise PlanningError("", "has a machine that cannot steer", "give its drive a steering angle and rate above 0")
    space = FreeSpace(task.boundary, task.obstacles, machine, task.margin_m)
    tool = (0.0, 0.0)
    reach = as_area(reachable(area, space.free, machine.outline, tool, machine.width_m))
    space.settle(area, task.start)
    aim = reach
    if space.home is not None:
        aim = as_area(reachable(area, space.free, machine.outline, tool, machine.width_m, space.home))
    covering = _Covering(task, space, aim, progress) if not aim.is_empty else None
    if covering is None or not (covering.laps or covering.items or covering.offers):
        size = f"{machine.width_m:g} m wide and {machine.nose_m + machine.tail_m:g} m long"
        problem = f"has an area in which the machine ({size}) finds no room for a single straight"
        raise PlanningError("", problem, "enlarge the area, take away obstacles, or use a smaller machine")
    route = covering.route()
    if not route.pieces:
        raise PlanningError("", "has no path for the machine from its start pose", "give it more room there")
    beyond = reach.area - aim.area
    if beyond < BEYOND_MIN_M2:
        return route
    remark = f"{beyond:.1f} m² are left out: the passage to them is too narrow for the machine"
    return replace(route, reachable=reach, remarks=(*route.remarks, remark))


class _Covering:
    """Planner of one area, stage by stage."""

    def __init__(
        self,
        task: CoverageTask,
        space: FreeSpace,
        reach: Area,
        progress: Callable[[float], None],
    ) -> None:
        machine = task.machine
        self.task, self.space, self.reach, self.progress = task, space, reach, progress
        self.reversing = machine.can_reverse and not task.forward_only
        self.covered = CoverageRaster(reach, machine.width_m)
        self.finder = TransitionFinder(space, self.covered, LANE_S_PER_M2, reversing=self.reversing)
        self.chain = StrokeChain(self.finder)
        self.laps: list[list[CoverStroke]] = []
        self.items: list[CoverLane] = []
        self.left_out: list[CoverStroke] = []
        self.offers = [*departures(task.start, space, reversing=self.reversing)] if task.start is not None else []
        found: list[CoverLane] = []
        self.laps_fit = 0
        pitch, rest = machine.width_m - task.overlap_m, as_area(intersection(_beside(space), task.area))
        for lap in range(1 if task.laps is None else task.laps):
            # Further laps overlap as lanes do; the last one has lanes inside that turn over it.
            target = rest if not lap else as_area(buffer(rest, machine.width_m - pitch, join_style="mitre"))
            laid = [
                sides(
                    ring,
                    f"lap {lap + 1}.{number}" if number else f"lap {lap + 1}" if lap else "lap",
                    space,
                    task.remaining,
                )
                for number, ring in enumerate(rings(target, machine.width_m))
            ]
            if not any(laid):
                break
            self.laps_fit += 1
            outer, inner = laid[0], [side for ring in laid[1:] for side in ring]
            self.items += inner
            self.laps += [[side.along for side in outer]] if outer else []
            found += outer
            rest = as_area(buffer(rest, -machine.width_m, join_style="mitre", mitre_limit=3.0))
        self.angle_rad = 0.0
        if not rest.is_empty:
            asked = task.swath_angle_deg
            self.angle_rad = lane_angle(rest, pitch) if asked is None else math.radians(asked)
            self.items = [*lanes(rest, self.angle_rad, pitch, space, task.remaining), *self.items]
        pairs = [(item.along, item.back) for item in (*self.items, *found)]
        self.opposite = dict(pairs) | {back: along for along, back in pairs}

    def route(self) -> CoverageRoute:
        """Run all stages and return the route."""
        self._build()
        self.progress(JOINED)
        self._improve(LANE_S_PER_M2)
        self.progress(0.5 * (JOINED + IMPROVED))
        self._improve(2.0 * LANE_S_PER_M2)
        self.progress(IMPROVED)
        self._touch_up()
        return CoverageRoute(tuple(self._pieces()), self.reach, tuple(self._remarks()))

    def _remarks(self) -> Iterator[str]:
        """Remarks on what could not be done, and on strokes that proved needless."""
        if self.laps_fit < (self.task.laps or 0):
            yield f"{self.task.laps} laps are asked for, {self.laps_fit} fit: there is no room further in"
        for stroke in self.left_out:
            yield f"{stroke.label} cannot be reached from the rest: it is left out"
        driven = zip(self.chain.strokes, self.chain.paths(), strict=True)
        needless = [stroke for stroke, (worked, _) in driven if worked is None and stroke in self.opposite]
        if needless:
            missed_m2 = plain_sum(self.covered.add(stroke.part(0.0, stroke.length_m), 0) for stroke in needless)
            others = f"turns and other straights cover what they would, but for {missed_m2:.1f} m² at most"
            yield f"left out, as {others}: {'; '.join(stroke.label for stroke in needless)}"
        wanted = self.covered.wanted_m2
        covered_pct = 100.0 * (1.0 - self.covered.missed_m2 / wanted) if wanted else 100.0
        if covered_pct < self.task.coverage_pct - 100.0 * RASTER_SHARE:
            asked = f"{self.task.coverage_pct:g} % of what the tool can reach is aimed at"
            yield f"{asked}, {covered_pct:.1f} % is covered: no path to more is worth its time"

    def _build(self) -> None:
        """Order laps and lanes, and find first transitions between them."""
        strokes = self._ordered()
        self.progress(ORDERED)
        self._lay(strokes)
        lost_m2 = LOST_SHARE * self.covered.wanted_m2
        if not self.left_out or self.covered.missed_m2 <= lost_m2:
            return
        offers = sorted((*self.left_out, *map(self._turned, self.left_out)), key=lambda stroke: -stroke.length_m)
        best = self.covered.missed_m2, self.chain.state, self.left_out
        for first in offers[: min(STARTS_TRIED, max(STROKES_ANEW // len(strokes), 1))]:
            self.chain.clear()
            self._lay([first, *(stroke for stroke in strokes if stroke not in (first, self._turned(first)))])
            if self.covered.missed_m2 < best[0]:
                best = self.covered.missed_m2, self.chain.state, self.left_out
            if best[0] <= lost_m2:
                break
        self.chain.restore(best[1])
        self.left_out = best[2]

    def _turned(self, stroke: CoverStroke) -> CoverStroke:
        """Stroke on the same stretch in the opposite direction, if there is one."""
        return self.opposite.get(stroke, stroke)

    def _lay(self, strokes: list[CoverStroke]) -> None:
        """Join strokes in order, then insert those that could not be joined, in either direction."""
        chain, self.left_out = self.chain, []
        for number, stroke in enumerate(strokes):
            self._price(chain.strokes[-1] if chain.strokes else None, stroke, LANE_S_PER_M2)
            vias = partial(self._vias, stroke, strokes)
            if self.offers and not chain.strokes:
                found = set_out(chain, self.offers, stroke, vias)
            else:
                found = chain.append_over(stroke, vias())
            if not found:
                self.left_out.append(stroke)
            self.progress(ORDERED + (JOINED - ORDERED) * number / len(strokes))
        if self.offers and not chain.strokes:
            chain.append(self.offers[0])
        chain.forget()
        self.finder.reversing, self.finder.seconds_per_m2 = self.reversing, TOUCH_UP_S_PER_M2[-1]
        again = True
        while again:
            again = False
            for stroke in [*self.left_out]:
                self.progress(JOINED)
                options = dict.fromkeys((stroke, self._turned(stroke)))
                if any(
                    chain.insert(k, option) for option in options for k in places(chain, option, 0.0, INSERTS_TRIED)
                ):
                    self.left_out.remove(stroke)
                    again = True

    def _ordered(self) -> list[CoverStroke]:
        """Order the strokes; the chain counts them and the turns between them in advance."""
        chain, sides_of_laps = self.chain, [side for lap in self.laps for side in lap]
        for side in sides_of_laps:
            chain.expect(side, [side.part(0.0, side.length_m)])
        begins_rad = self.task.begins_rad
        lasts = sides_of_laps if begins_rad is None else [lap[self._last(lap, begins_rad)] for lap in self.laps[-1:]]
        entries = [entry for side in lasts for entry in self._entries(side)]
        search = LaneOrder(self.items, self.angle_rad, entries, self.finder, turn_room(self.space.machine))
        for lane in self.items:
            chain.expect(lane.along, [search.part(lane.along)])
        self.progress(0.5 * ORDERED)
        tour = search.best()
        chain.forget()
        inside, around = tour[:1], list[CoverStroke]()
        for lap in reversed(self.laps):
            ring = self._towards(lap, inside, search)
            inside, around = ring[:1], [*ring, *around]
        for side in around:
            chain.expect(side, [side.part(0.0, side.length_m)])
        for stroke in tour:
            chain.expect(stroke, [search.part(stroke)])
        for before, stroke in pairwise(tour):
            chain.expect(stroke, [search.word(before, stroke)])
        return [*around, *tour]

    def _towards(self, lap: list[CoverStroke], inside: list[CoverStroke], search: LaneOrder) -> list[CoverStroke]:
        """Sides of a lap, ending with the one from which the first stroke inside is nearest."""
        last = -1
        if self.task.begins_rad is not None:
            last = self._last(lap, self.task.begins_rad)
        elif inside:
            seconds = [replace(search, entries=self._entries(side)).entry_s(inside[0]) for side in lap]
            last = seconds.index(min(seconds))
        if self.reversing:
            return [*lap[last + 1 :], *lap[: last + 1]]
        ring = [*lap[last:], *lap[:last]]
        return [*ring, replace(ring[0], label="lap, closed", length_m=min(ring[0].length_m, CLOSING_M))]

    def _last(self, lap: list[CoverStroke], begins_rad: float) -> int:
        """Index of the last side of a lap that begins with the side in a direction (rad)."""
        off = [abs(math.remainder(side.start.heading_rad - begins_rad, math.tau)) for side in lap]
        return off.index(min(off)) - self.reversing

    def _entries(self, side: CoverStroke) -> list[PathPose]:
        """Poses on the last side of a lap from which the lanes may be entered."""
        back = side.length_m - np.arange(4.0, ZONE_M, 2.0)
        at = back if self.reversing else np.arange(8.0, CLOSING_M, 2.0)
        return [side.at(s) for s in at[(at > 0.0) & (at < side.length_m)].tolist()] or [side.at(0.5 * side.length_m)]

    def _price(self, first: CoverStroke | None, last: CoverStroke, lane_s: float, *, lanes_back: bool = False) -> None:
        """Set price and direction for a pair of strokes: lanes forward by default, laps back into their corners."""
        lanes = first is not None and first.kind == last.kind == DriveKind.LANE
        self.finder.reversing = self.reversing and (lanes_back or not lanes)
        self.finder.seconds_per_m2 = lane_s if lanes else max(lane_s, LAP_S_PER_M2)

    def _vias(self, stroke: CoverStroke, strokes: list[CoverStroke]) -> Iterator[CoverStroke]:
        """Short stretches of other strokes as via strokes, those with the shortest detour first."""
        mover, last = self.finder.mover, self.chain.strokes[-1]
        along = [
            (s, other.at(s)) for other in strokes for s in np.arange(1.0, other.length_m - VIA_M, VIA_EVERY_M).tolist()
        ]
        if not along:
            return
        poses = np.array([pose for _, pose in along])
        there = words_s(np.array([last.at(last.length_m)]), poses, mover)[0]
        around = there + words_s(poses, np.array([stroke.start]), mover)[:, 0]
        found = sorted(zip(around.tolist(), along, strict=True), key=lambda each: (each[0], each[1][0]))
        yield from (CoverStroke(DriveKind.TURN, "via", pose, VIA_M) for _, (_, pose) in found[:VIAS_TRIED])

    def _improve(self, lane_s: float, *, lanes_back: bool = False, enough_m2: float = 0.0) -> None:
        """Search every transition again, now that all others are known, while more than `enough_m2` is missed."""
        for k in range(len(self.chain.transitions)):
            if self.covered.missed_m2 <= enough_m2:
                return
            first, last = self.chain.strokes[k : k + 2]
            self._price(first, last, lane_s, lanes_back=lanes_back)
            self.chain.rejoin(k)

    def _touch_up(self) -> None:
        """Cover missed patches, the cheapest first, until the coverage is as asked."""
        headings = {
            round(stroke.start.heading_rad, 9)
            for stroke in [
                *(side for lap in self.laps for side in lap),
                *(stroke for item in self.items for stroke in (item.along, item.back)),
                *(stroke for offer in self.offers for stroke in (offer, offer.turned)),
            ]
        }
        share = 1.0 - 0.01 * self.task.coverage_pct - RASTER_SHARE
        enough = max(share, 0.0) * self.covered.wanted_m2
        if self.covered.missed_m2 <= enough:
            return
        begun = self.covered.missed_m2

        def report() -> None:
            self.progress(IMPROVED + (1.0 - IMPROVED) * max(begun - self.covered.missed_m2, 0.0) / (begun - enough))

        for worth in TOUCH_UP_S_PER_M2:
            if self.covered.missed_m2 <= enough:
                break
            self.finder.reversing, self.finder.seconds_per_m2 = self.reversing, worth
            touched_up(self.chain, sorted(headings), enough, report)
            # Turns beside a touch-up need no detour for that ground any more.
            self._improve(LAP_S_PER_M2, enough_m2=enough)
            self._improve(worth, lanes_back=True, enough_m2=enough)
        for k in range(len(self.chain.transitions)):
            self.finder.reversing, self.finder.seconds_per_m2 = self.reversing, LANE_S_PER_M2
            self.chain.rejoin(k, enough)

    def _pieces(self) -> Iterator[DrivePiece]:
        if self.offers and not self.chain.transitions:
            return
        for stroke, (worked, others) in zip(self.chain.strokes, self.chain.paths(), strict=True):
            if worked:
                yield from split_at_cusps(stroke.kind, stroke.label, worked, worked=True)
            for other in others:
                path = PiecePath(other.start, joined(other.pieces))
                yield from split_at_cusps(DriveKind.TURN, f"{stroke.label}, turn", path, worked=False)
