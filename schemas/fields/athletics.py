"""The 400 m athletics track."""

import math
from typing import Annotated

from pydantic import Field

from touchline.schemas.fields.sheet import Parameters, Sheet, metres
from touchline.schemas.template import Template

LINE_M, LAP_M = 0.05, 400.0
#: Where a runner is taken to run: from the kerb in lane 1, from the line on the left in every other lane.
RUN_KERB_M, RUN_LINE_M = 0.30, 0.20
SPRINTS_M, START_AREA_M, RUN_OUT_M = (100.0, 110.0), 3.0, 17.0


class AthleticsTrack(Parameters):
    """Rules TR14 and TR15; the straights follow from the radius, so that lane 1 is 400 m long."""

    lanes: Annotated[int, Field(ge=4, le=9, description="lanes of the oval and of the home straight")] = 8
    radius: Annotated[float, Field(ge=35, le=38, description="kerb's outer edge in the bends, m")] = 36.50
    lane_width: Annotated[float, Field(ge=1.21, le=1.23, description="with the line on its right, m")] = 1.22
    inner_line: Annotated[bool, Field(description="also paint a line along the inside of lane 1, at the kerb")] = False
    start_lines: Annotated[bool, Field(description="100, 110, 200 and 400 m start lines and the finish")] = True


def athletics_track(p: AthleticsTrack) -> Template:
    """Lane lines from the inside out, then the home straight's extension, then finish and starts."""
    sheet = Sheet(LINE_M)
    straight = straight_m(p)
    if p.inner_line:
        _oval(sheet, "inner-line", "Inner line", p.radius - sheet.half, straight)
    for lane in range(1, p.lanes + 1):
        radius = p.radius + lane * p.lane_width - sheet.half
        _oval(sheet, f"lane-{lane}", f"Lane {lane}, outer line", radius, straight)
    _home_straight(sheet, p, straight)
    if p.start_lines:
        _starts(sheet, p, straight)
    source = (
        "World Athletics Competition and Technical Rules 2024, TR14 and TR15, and Track and Field Facilities "
        "Manual 2019, 1.4 (400 m standard track: radius 36.50 m, straights 84.39 m). Origin at the centre, x "
        "along the straights, y north, in m; running is counter-clockwise, the home straight in the south, the "
        "finish at its east end. The radius is that of the kerb's outer edge, lane 1 is measured 0.30 m outside "
        "it and the others 0.20 m outside the line on their left; lanes are 1.22 m wide with the 50 mm line on "
        "their right. Included: lane lines of oval, sprint straight (3 m before the 110 m start to 17 m after the"
        " finish), finish line, start lines of 100, 110 m (straight), 200 and 400 m (staggered, in lanes; the "
        "edge further from the finish is the distance). Not included: kerb, hurdle, relay and break-line marks, "
        "curved starts, lane numbers."
    )
    title = f"Athletics track, 400 m, {p.lanes} lanes, radius {metres(p.radius)} m"
    return sheet.template("athletics-400", title, source)


def straight_m(p: AthleticsTrack) -> float:
    """Length of a straight: what the two bends at the running line of lane 1 leave of 400 m, to the centimetre."""
    return round((LAP_M - 2 * math.pi * (p.radius + RUN_KERB_M)) / 2, 2)


def stagger_m(p: AthleticsTrack, lane: int, bends: int) -> float:
    """Length that a lane has more than lane 1 over so many bends, m."""
    return bends * math.pi * (run_radius_m(p, lane) - run_radius_m(p, 1))


def run_radius_m(p: AthleticsTrack, lane: int) -> float:
    """Radius of a lane's running line in the bends, m."""
    return p.radius + (lane - 1) * p.lane_width + (RUN_KERB_M if lane == 1 else RUN_LINE_M)


def _oval(sheet: Sheet, name: str, label: str, radius: float, straight: float) -> None:
    """Clockwise: home straight westwards, west bend, back straight eastwards, east bend."""
    x = straight / 2
    sheet.line(f"{name}-home", f"{label}, home straight", (x, -radius), (-x, -radius))
    sheet.arc(f"{name}-west", f"{label}, west bend", (-x, -radius), (-x, 0.0), -math.pi)
    sheet.line(f"{name}-back", f"{label}, back straight", (-x, radius), (x, radius))
    sheet.arc(f"{name}-east", f"{label}, east bend", (x, radius), (x, 0.0), -math.pi)


def _home_straight(sheet: Sheet, p: AthleticsTrack, straight: float) -> None:
    x, start = straight / 2, straight / 2 - SPRINTS_M[-1] - START_AREA_M
    for part, (near, far) in {"run-out": (x, x + RUN_OUT_M), "sprint": (-x, start)}.items():
        for lane in range(p.lanes + 1):
            y = -(p.radius + lane * p.lane_width - sheet.half)
            if part == "run-out" and lane == 0:
                continue
            sign = 1 if lane % 2 == 0 else -1
            ends = ((near, y), (far, y))[::sign]
            sheet.line(f"{part}-{lane}", f"Home straight, {part}, line {lane}", *ends)


def _starts(sheet: Sheet, p: AthleticsTrack, straight: float) -> None:
    finish, half = straight / 2, sheet.half
    inner, outer = -p.radius, -(p.radius + p.lanes * p.lane_width)
    sheet.line("finish-line", "Finish line", (finish + half, inner), (finish + half, outer))
    for distance in SPRINTS_M:
        x = finish - distance + half
        sheet.line(f"start-{distance:g}", f"Start, {distance:g} m", (x, inner), (x, outer))
    for distance, bends, center, turned in ((200, 1, -straight / 2, math.pi / 2), (400, 2, finish, -math.pi / 2)):
        # Lane 1 starts 400 m at the finish line, which is there already.
        for lane in range(1 if bends == 1 else 2, p.lanes + 1):
            ahead = stagger_m(p, lane, bends)
            _start(sheet, p, f"{distance}", lane, (center, turned), ahead + half)


def _start(sheet: Sheet, p: AthleticsTrack, distance: str, lane: int, bend: tuple[float, float], ahead: float) -> None:
    """One lane's start line, ``ahead`` along its running line from the beginning of a bend (centre x, polar angle)."""
    center, angle = bend[0], bend[1] + ahead / run_radius_m(p, lane)
    inner = p.radius + (lane - 1) * p.lane_width
    ends = [(center + r * math.cos(angle), r * math.sin(angle)) for r in (inner, inner + p.lane_width - LINE_M)]
    sheet.line(f"start-{distance}-lane-{lane}", f"Start, {distance} m, lane {lane}", ends[0], ends[1])
