"""Area method `lap-and-lanes`: laps along the edges, then lanes, each turn where it costs least time and area."""

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from collections.abc import Sequence

import numpy as np
import shapely

from touchline.schemas.errors import PlanningError
from touchline.services.planner.coverage.cover_stroke import CoverStroke
from touchline.services.planner.coverage.coverage_route import CoverageRoute, DriveKind, DrivePiece, one_way
from touchline.services.planner.coverage.free_space import FreeSpace
from touchline.services.planner.coverage.lane_order import LaneOrder, turn_room
from touchline.services.planner.coverage.lanes import Lane, lane_angle, lanes
from touchline.services.planner.coverage.laps import rings, sides
from touchline.services.planner.coverage.machine import CoverageMachine
from touchline.services.planner.coverage.reachable import reachable
from touchline.services.planner.coverage.stroke_chain import StrokeChain
from touchline.services.planner.coverage.stroke_join import ZONE_M, Joiner
from touchline.services.planner.coverage.stroke_map import StrokeMap
from touchline.services.planner.coverage.touch_up import touched_up
from touchline.services.planner.geometry.clothoid import joined, PiecePath


CLOSING_M = 20.0

@dataclass(frozen=True)
class CoverOptions:
    """How an area is covered."""

    forward_only: bool = False
    overlap_m: float = 0.03
    margin_m: float = 0.05
    swath_angle_deg: float | None = None
    seconds_per_m2: float = 8.0
    order_spm2: float = 8.0
    cell: float = 0.1
    lane_spm2: float = 8.0
    ladder: tuple[float, ...] = ()
    lane2: float = 8.


def cover(
    area: shapely.Polygon,
    boundary: shapely.Polygon | None,
    obstacles: Sequence[shapely.Polygon],
    machine: CoverageMachine,
    options: CoverOptions | None = None,
) -> CoverageRoute:
    options = options or CoverOptions()
    kept_out = [*obstacles, *(shapely.Polygon(ring) for ring in area.interiors)]
    space = FreeSpace(boundary or shapely.Polygon(area.exterior), kept_out, machine, options.margin_m)
    reach = reachable(area, space)
    if reach.is_empty:
        raise PlanningError("", "no room", "x")
    target = space.free.intersection(area)
    covered = StrokeMap(reach, machine.width_m, options.cell)
    reversing = machine.can_reverse and not options.forward_only
    joiner = Joiner(space, covered, options.seconds_per_m2, reversing=reversing)

    outer, *inner = rings(target, machine.width_m)
    lap = sides(outer, "lap", space)
    pitch = machine.width_m - options.overlap_m
    rest = target.buffer(-machine.width_m, join_style="mitre", mitre_limit=3.0)
    angle = math.radians(options.swath_angle_deg) if options.swath_angle_deg is not None else lane_angle(rest, pitch)
    items = lanes(rest, angle, pitch, space)
    room = turn_room(machine)
    chain = StrokeChain(joiner)
    remarks = []
    for stroke in lap:
        chain.expect(stroke, [stroke.part(0.0, stroke.length_m)])
    entries = [_entries(side, reversing=reversing) for side in lap]
    joiner.seconds_per_m2 = options.order_spm2
    search = LaneOrder(items, angle, [pose for poses in entries for pose in poses], joiner, room)
    for lane in items:
        chain.expect(lane.along, [search.part(lane.along)])
    tour = search.best()
    joiner.seconds_per_m2 = options.seconds_per_m2
    chain.forget()
    last = min(range(len(lap)), key=lambda k: replace(search, entries=entries[k]).entry_s(tour[0]))
    closed = [*lap[last + 1 :], *lap[: last + 1]]
    if not reversing:
        closed = [*lap[last:], *lap[:last]]
        again = closed[0]
        closed.append(CoverStroke(again.kind, "lap, closed", again.start, min(again.length_m, CLOSING_M)))
    for stroke in closed:
        chain.expect(stroke, [stroke.part(0.0, stroke.length_m)])
    for stroke in tour:
        chain.expect(stroke, [search.part(stroke)])
    for before, stroke in pairwise(tour):
        chain.expect(stroke, [search.word(before, stroke)])
    for stroke in [*closed, *tour]:
        if stroke is tour[0]:
            joiner.seconds_per_m2 = options.lane_spm2
            joiner.reversing = reversing
        if stroke is not tour[0] and stroke in tour:
            joiner.reversing = False
        if not chain.append(stroke):
            remarks.append(f"no way to {stroke.label}")
    def again(lane_spm2, lanes_reverse=False):
        for k in range(len(chain.joins)):
            between = chain.strokes[k].kind == DriveKind.LANE
            joiner.seconds_per_m2 = lane_spm2 if between else max(lane_spm2, options.seconds_per_m2)
            joiner.reversing = reversing and (lanes_reverse or not between)
            chain.rejoin(k)
    import time
    def say(what):
        print(what, f'{chain.seconds/60:.2f} min, missed {covered.missed_m2:.1f} m2, {time.time()-t0:.1f} s')
    t0=time.time()
    say('built')
    again(options.lane_spm2)
    say('again')
    headings = sorted({round(s.start.heading_rad,9) for s in [*lap, *(l.along for l in items), *(l.back for l in items)]})
    for worth in options.ladder:
        joiner.seconds_per_m2 = worth
        joiner.reversing = reversing
        touched_up(chain, headings)
        say(f'touched {worth}')
        again(options.lane2)
        say('again')
        again(worth, True)
        say('again')
    return CoverageRoute(tuple(_pieces(chain)), reach, tuple(remarks))


def _entries(side: CoverStroke, *, reversing: bool):
    """Where the way to the lanes may begin on the last side of a lap."""
    at = side.length_m - np.arange(4.0, ZONE_M, 2.0) if reversing else np.arange(8.0, CLOSING_M, 2.0)
    return [side.at(s) for s in at[(at>0)&(at<side.length_m)].tolist()]


def _pieces(chain: StrokeChain):
    # one-way pieces
    out: list[DrivePiece] = []
    for stroke, parts in zip(chain.strokes, chain.paths(), strict=True):
        worked, *rest = parts
        out += one_way(stroke.kind, stroke.label, worked, worked=True)
        for part in rest:
            out += one_way(DriveKind.TURN, f"{stroke.label}, turn", PiecePath(part.start, joined(part.pieces)), worked=False)
    return out
