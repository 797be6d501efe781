"""The baseball infield."""

import math
from typing import Annotated

from pydantic import Field

from touchline.schemas.fields.sheet import FOOT_M, INCH_M, Parameters, Sheet
from touchline.schemas.template import Template

BASE_PATH_M = 90 * FOOT_M
PLATE_M, PLATE_GAP_M = 17 * INCH_M, 6 * INCH_M
BOX_WIDTH_M, BOX_LENGTH_M = 4 * FOOT_M, 6 * FOOT_M
CATCHER_WIDTH_M, CATCHER_DEPTH_M = 43 * INCH_M, 8 * FOOT_M
COACH_LENGTH_M, COACH_DEPTH_M, COACH_GAP_M = 20 * FOOT_M, 10 * FOOT_M, 15 * FOOT_M
LANE_FROM_M, LANE_GAP_M = 45 * FOOT_M, 3 * FOOT_M
PITCHER_M, GRASS_M = 60.5 * FOOT_M, 95 * FOOT_M
MOUND_FROM_HOME_M, MOUND_M, HOME_CIRCLE_M = 59 * FOOT_M, 9 * FOOT_M, 13 * FOOT_M

Point = tuple[float, float]


class Baseball(Parameters):
    """Rule 2.01: a fixed infield; foul lines as long as the ground allows."""

    foul_line: Annotated[float, Field(ge=76.2, le=130, description="foul lines from home base, m")] = 320 * FOOT_M
    line_width: Annotated[float, Field(ge=0.05, le=0.1016, description="all lines (2 to 4 inches), m")] = 4 * INCH_M
    grass_lines: Annotated[bool, Field(description="guides for cutting the grass, mound and home-base circles")] = True


def baseball(p: Baseball) -> Template:
    """The infield with its foul lines."""
    sheet = Sheet(p.line_width)
    _home(sheet)
    _side(sheet, p, "first", 1)
    _side(sheet, p, "third", -1)
    if p.grass_lines:
        _grass(sheet)
    source = (
        "Official Baseball Rules 2024 (MLB), Rule 2.01 and Appendices 1 and 2. Origin at the rear tip of home "
        "base, y towards second base, x towards first base, in m. Foul lines are fair territory: their outer "
        "edges are the sides of the 90-foot square, extended; they begin at the front of the batter's boxes. "
        "Boxes and lane are measured to the outside of the lines: batter's boxes 4 by 6 feet, 6 inches from home "
        "base and centred on it; catcher's box 43 inches by 8 feet from the tip; coach's boxes 20 by 10 feet, 15 "
        "feet from the foul line; three-foot lane outside the foul line from 45 feet to first base. The rules "
        "give no width of line: 4 inches are customary. Guides for the grass line (95 feet from the pitcher's "
        "plate), mound (9 feet) and home-base circle (13 feet) are centred on their radii; they can be left out. "
        "Bases and plates are not painted."
    )
    return sheet.template("baseball-infield", "Baseball infield, 90-foot bases", source)


def _home(sheet: Sheet) -> None:
    """Batter's boxes, and the catcher's box from their backs."""
    half = sheet.half
    middle = PLATE_M / 2
    near, far = PLATE_M / 2 + PLATE_GAP_M + half, PLATE_M / 2 + PLATE_GAP_M + BOX_WIDTH_M - half
    back, front = middle - BOX_LENGTH_M / 2 + half, middle + BOX_LENGTH_M / 2 - half
    sides = ("inner", "front", "outer", "back")
    for name, sign in (("left", -1), ("right", 1)):
        box = [(near, back), (near, front), (far, front), (far, back), (near, back)]
        sheet.polyline(f"batters-box-{name}", f"Batter's box ({name})", sides, [(sign * x, y) for x, y in box])
    x, rear = CATCHER_WIDTH_M / 2 - half, -CATCHER_DEPTH_M + half
    catcher = [(x, back), (x, rear), (-x, rear), (-x, back)]
    sheet.polyline("catchers-box", "Catcher's box", ("right", "rear", "left"), catcher)


def _side(sheet: Sheet, p: Baseball, base: str, sign: int) -> None:
    """Foul line, lane and coach's box of first base, or mirrored of third.

    Worked out along the foul line (u from home base) and square to it (v into foul territory).
    """
    half = sheet.half

    def at(u: float, v: float) -> Point:
        return (sign * (u + v) / math.sqrt(2), (u - v) / math.sqrt(2))

    front = PLATE_M / 2 + BOX_LENGTH_M / 2
    # Where the stroke's centre, half a width inside the square, crosses the front of the batter's box.
    start = front * math.sqrt(2) - half
    sheet.line(f"foul-line-{base}", f"Foul line ({base} base)", at(start, -half), at(p.foul_line, -half))
    coach, deep = COACH_GAP_M + half, COACH_GAP_M + COACH_DEPTH_M
    near, far = BASE_PATH_M - COACH_LENGTH_M + half, BASE_PATH_M - half
    box = [at(far, deep), at(far, coach), at(near, coach), at(near, deep)]
    sheet.polyline(f"coachs-box-{base}", f"Coach's box ({base} base)", ("outfield", "front", "home"), box)
    if base == "first":
        lane = [at(BASE_PATH_M, LANE_GAP_M - half), at(LANE_FROM_M + half, LANE_GAP_M - half)]
        lane.append(at(LANE_FROM_M + half, 0.0))
        sheet.polyline("three-foot-lane", "Three-foot lane", ("outer", "home"), lane)


def _grass(sheet: Sheet) -> None:
    """Circles of home base and mound, and the arc behind the bases as far as the foul lines, all clockwise."""
    sheet.circle("home-base-circle", "Home-base circle (guide)", (0.0, 0.0), HOME_CIRCLE_M)
    sheet.circle("mound-circle", "Mound (guide)", (0.0, MOUND_FROM_HOME_M), MOUND_M)
    # The foul lines x = ± y meet the circle about the pitcher's plate where (y − P)² + y² = R².
    y = (PITCHER_M + math.sqrt(2 * GRASS_M**2 - PITCHER_M**2)) / 2
    angle = math.atan2(y - PITCHER_M, y)
    sheet.arc_between("grass-line", "Grass line (guide)", (0.0, PITCHER_M), GRASS_M, (math.pi - angle, angle))
