"""The field hockey field."""

import math
from typing import Annotated

from pydantic import Field

from touchline.schemas.fields.sheet import Parameters, Sheet
from touchline.schemas.template import Template

LENGTH_M, WIDTH_M, LINE_M = 91.40, 55.00, 0.075
POST_M, CIRCLE_M, BROKEN_M = 3.66 / 2, 14.63, 14.63 + 5.00
LINE_23_M, SPOT_M, SPOT_DIAMETER_M = 22.90, 6.40, 0.15
MARK_M, GOAL_MARK_M, DASH_M, GAP_M = 0.30, 0.15, 0.30, 3.00


class FieldHockey(Parameters):
    """Fixed dimensions; the marks beyond the lines and round the circles can be left out."""

    broken_circles: Annotated[bool, Field(description="the broken lines 5 m outside the circles")] = True
    outside_marks: Annotated[bool, Field(description="the marks outside the side-lines and back-lines")] = True


def field_hockey(p: FieldHockey) -> Template:
    """The field of the FIH."""
    sheet = Sheet(LINE_M)
    _west(sheet, p)
    west = list(sheet.segments)
    y = WIDTH_M / 2 - sheet.half
    sheet.line("centre-line", "Centre line", (0.0, y), (0.0, -y))
    sheet.half_turn(west)
    sheet.boundary(LENGTH_M, WIDTH_M, ("Back-line", "Side-line"), inside=True)
    source = (
        "FIH Rules of Hockey 2022, Field and Equipment Specifications, section 1 (Field of Play). Origin at the "
        "centre, x along the side-lines, y north, in m. All lines are 75 mm wide and part of the field: 91.40 by "
        "55.00 m are to the outside of the lines, circles are 14.63 m to the outside, the edges of the 23-metre "
        "lines nearer the centre are 22.90 m from the outside of the back-lines. Penalty spots are 6.40 m from "
        "the inner edge of the goal line; the 150 mm disc is painted as two strokes. Marks outside the field run "
        "from the line's outer edge; those on the back-lines are measured from the outside of a goal-post of 50 "
        "mm. Broken lines have their outer edge 5 m outside the circles' and 300 mm dashes with gaps of 3 m from "
        "a solid section at the top."
    )
    return sheet.template("field-hockey", "Field hockey, 91.40 x 55.00 m", source)


def _west(sheet: Sheet, p: FieldHockey) -> None:
    edge, half = -LENGTH_M / 2, sheet.half
    if p.outside_marks:
        _outside_marks(sheet)
    sheet.spot("penalty-spot-west", "Penalty spot (west)", (edge + LINE_M + SPOT_M, 0.0), SPOT_DIAMETER_M)
    radius = CIRCLE_M - half
    # The quarter circles end at the centre of the back-line, as every line ends at the centre of the one it joins.
    end = math.acos(half / radius)
    front = edge + radius
    north, south = (edge, POST_M), (edge, -POST_M)
    sheet.arc_between("circle-west-north", "Circle (west), north quarter", north, radius, (end, 0.0))
    sheet.line("circle-west-top", "Circle (west), top", (front, POST_M), (front, -POST_M))
    sheet.arc_between("circle-west-south", "Circle (west), south quarter", south, radius, (0.0, -end))
    if p.broken_circles:
        _broken(sheet, edge, BROKEN_M - half)
    line_23, y = edge + LINE_23_M - half, WIDTH_M / 2 - half
    sheet.line("23-metre-line-west", "23-metre line (west)", (line_23, y), (line_23, -y))


def _broken(sheet: Sheet, edge: float, radius: float) -> None:
    """Dashes along the path quarter circle, top line, quarter circle, from the north to the south."""
    pitch, front = DASH_M + GAP_M, edge + radius
    end = min(POST_M + radius * math.pi / 2, WIDTH_M)
    count = int((end - DASH_M / 2) / pitch)
    for index in range(-count, count + 1):
        name, label = f"broken-line-west-{index + count + 1}", "Broken line (west), dash"
        middle = index * pitch
        if abs(middle) + DASH_M / 2 <= POST_M:
            sheet.line(name, label, (front, -middle + DASH_M / 2), (front, -middle - DASH_M / 2))
            continue
        sign = 1 if index < 0 else -1
        angle, spread = sign * (abs(middle) - POST_M) / radius, DASH_M / 2 / radius
        sheet.arc_between(name, label, (edge, sign * POST_M), radius, (angle + spread, angle - spread))


def _outside_marks(sheet: Sheet) -> None:
    edge, side, half = -LENGTH_M / 2, WIDTH_M / 2, sheet.half
    for at in (5.00, CIRCLE_M):
        x = edge + at - half
        name, label = f"side-mark-west-{at:g}", f"Mark {at:.2f} m from the back-line (west)"
        sheet.line(f"{name}-north".replace(".", "-"), label, (x, side + MARK_M), (x, side))
        sheet.line(f"{name}-south".replace(".", "-"), label, (x, -side), (x, -side - MARK_M))
    for sign, name in ((1, "north"), (-1, "south")):
        for at in (10.00, 5.00):
            y = sign * (POST_M + 0.05 + at - half)
            label = f"Mark {at:g} m from the goal (west)"
            sheet.line(f"back-mark-west-{at:g}-{name}", label, (edge - MARK_M, y), (edge, y))
        y = sign * (POST_M + half)
        sheet.line(f"goal-mark-west-{name}", "Goal mark (west)", (edge - GOAL_MARK_M, y), (edge, y))
