"""A roller on a salt pan, in the messages that would tell of it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from tests.robot_sim.rolled import WIDTH_M, roller
from tests.tui import scenes
from tests.tui.scenes import FakeLink, received
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.template import Area, Polygon, Template
from touchline.tui.app import ConsoleApp
from touchline.tui.protocol import Incoming, PaintFetched

LENGTH_M, BREADTH_M = 40.0, 20.0
LANES = (1.1, 3.3, 6.5, 8.7, 10.9, 13.1, 15.3, 17.5, 18.9)
"""Their places; between the second and the third a strip of a metre is left out."""
CORNERS = ((0.0, 0.0), (LENGTH_M, 0.0), (LENGTH_M, BREADTH_M), (0.0, BREADTH_M))
POND = ((30.0, 15.0), (33.0, 15.0), (33.0, 18.0), (30.0, 18.0))


def template() -> Template:
    return Template(
        name="pan",
        title="Salt pan",
        areas=(Area(id="pan", outline=CORNERS, holes=(POND,)),),
        boundary=Polygon(corners=CORNERS),
        obstacles=(Polygon(id="pond", corners=POND),),
    )


def ends(lane: int) -> tuple[tuple[float, float], tuple[float, float]]:
    y = LANES[lane]
    return ((2.5, y), (37.5, y)) if lane % 2 == 0 else ((37.5, y), (2.5, y))


def plan() -> m.Trajectory:
    """Lanes there and back; no machine could turn so, but it looks like a plan."""
    segments: list[m.Segment] = []
    for lane in range(len(LANES)):
        if lane:
            segments.append(scenes.line_segment(f"t{lane}", "transition", ends(lane - 1)[1], ends(lane)[0]))
        segments.append(scenes.line_segment(f"pan#{lane + 1}", f"pan, swath {lane + 1}", *ends(lane)))
    return m.Trajectory(path=m.Path(segments=tuple(segments)))


def rolled(lanes: float) -> list[m.PaintMarks]:
    """The drum's way over so many lanes, the last of them in part."""
    points = [point for lane in range(int(lanes)) for point in ends(lane)]
    if lanes % 1:
        (x0, y0), (x1, _) = ends(int(lanes))
        points += [(x0, y0), (x0 + lanes % 1 * (x1 - x0), y0)]
    pieces = [np.linspace(a, b, 300)[1:] for a, b in pairwise(points)]
    x, y = np.vstack((points[:1], *pieces)).T
    return [m.PaintMarks(width_m=WIDTH_M, x_m=x, y_m=y)]


def rolling(lanes: float, state: int = m.TraversalStatus.RUNNING) -> list[Incoming]:
    count, lane = 2 * len(LANES) - 1, min(int(lanes), len(LANES) - 1)
    x, y = rolled(lanes)[0].x_m[-1], rolled(lanes)[0].y_m[-1]
    share = lanes / len(LANES)
    status = m.TraversalStatus(
        state=state,
        segment_index=2 * lane,
        segment_count=count,
        segment_id=f"pan#{lane + 1}",
        arc_length_m=340.0 * share,
        total_length_m=340.0,
        coverage_pct=100.0 * share,
        speed_mps=0.98,
        elapsed_s=420.0 * share,
        remaining_s=420.0 * (1.0 - share),
        lateral_error_m=0.012,
    )
    area = m.AreaProgress(
        area_m2=791.0, covered_m2=750.0 * share, coverage_pct=94.81 * share, overlap_m2=31.0, cell_m=0.05
    )
    return [
        *scenes.up(),
        received(topics.TEMPLATE, m.String(data=template().model_dump_json())),
        received(topics.PLAN, plan()),
        PaintFetched(tuple(rolled(lanes))),
        received(topics.STATUS, status),
        received(topics.AREA, area),
        received(topics.ODOMETRY, scenes.odometry(float(x), float(y), 0.0 if lane % 2 == 0 else np.pi)),
        *scenes.robot_health()[:2],
    ]


def finished() -> list[Incoming]:
    report = m.AreaReport(
        area_m2=791.0,
        covered_m2=750.0,
        coverage_pct=94.81,
        of_reachable_pct=95.12,
        of_planned_pct=99.97,
        overlap_m2=31.0,
        missed_m2=41.0,
        body_outside_m=0.042,
        lateral_error_p95_m=0.021,
        missed=(m.MissedPatch(x_m=20.0, y_m=4.9, area_m2=35.0), m.MissedPatch(x_m=0.5, y_m=9.0, area_m2=6.0)),
    )
    accepted = m.TraversalReport(success=True, paint_accepted=True, coverage_pct=94.81)
    done = rolling(float(len(LANES)), m.TraversalStatus.DONE)
    return [*done, received(topics.AREA_REPORT, report), received(topics.REPORT, accepted)]


def app_with(events: list[Incoming]) -> ConsoleApp:
    app = ConsoleApp(FakeLink(incoming=list(events)), clock=lambda: 1.0)
    app.state.vehicle = roller()
    return app
