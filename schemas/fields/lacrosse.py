"""The men's lacrosse field of the NCAA."""

from typing import Annotated

from pydantic import Field

from touchline.schemas.fields.sheet import FOOT_M, INCH_M, YARD_M, Parameters, Sheet
from touchline.schemas.template import Template

LENGTH_M, GOAL_M, CREASE_M = 110 * YARD_M, 15 * YARD_M, 9 * FOOT_M
RESTRAINING_M, WING_M, WING_REACH_M, GOAL_AREA_M = 20 * YARD_M, 20 * YARD_M, 10 * YARD_M, 40 * YARD_M
GOAL_LINE_M, CROSS_M, GATE_M, GATE_TICK_M = 6 * FOOT_M, 0.5, 10 * YARD_M, 2 * YARD_M


class Lacrosse(Parameters):
    """Rule 1: 110 by 60 yards; a football field's 53 1/3 yards are allowed where 60 are not there."""

    width: Annotated[float, Field(ge=48.76, le=54.9, description="sideline to sideline, outside, m")] = 60 * YARD_M
    line_width: Annotated[float, Field(ge=0.05, le=0.1016, description="all lines (2 to 4 inches), m")] = 4 * INCH_M
    gate: Annotated[bool, Field(description="the ticks of the special substitution area, outside the south")] = True


def lacrosse(p: Lacrosse) -> Template:
    """The NCAA men's field."""
    sheet = Sheet(p.line_width)
    y = p.width / 2 - sheet.half
    _west(sheet, y)
    west = list(sheet.segments)
    sheet.line("wing-line-north", "Wing-area line (north)", (-WING_REACH_M, WING_M), (WING_REACH_M, WING_M))
    sheet.line("centre-line", "Centre line", (0.0, y), (0.0, -y))
    sheet.line("face-off-mark", "Face-off mark", (-CROSS_M / 2, 0.0), (CROSS_M / 2, 0.0))
    sheet.line("wing-line-south", "Wing-area line (south)", (WING_REACH_M, -WING_M), (-WING_REACH_M, -WING_M))
    sheet.half_turn(west)
    if p.gate:
        for side, sign in (("east", 1), ("west", -1)):
            x, edge = sign * GATE_M, -p.width / 2
            sheet.line(f"gate-{side}", f"Special substitution area ({side})", (x, edge), (x, edge - GATE_TICK_M))
    sheet.boundary(LENGTH_M, p.width, ("End line", "Sideline"), inside=True)
    source = (
        "NCAA Men's Lacrosse Rules 2023 and 2024, Rule 1 (The Field). Origin at the centre, x along the "
        "sidelines, y north, in m. Boundaries are measured to the outside of the lines; restraining, wing and "
        "goal-area lines are centred on their distances: restraining lines 20 yards from the centre line, "
        "wing-area lines 20 yards from the centre and 20 long, goal-area lines 40 yards apart from the end lines "
        "to the restraining lines. Goal lines are centred 15 yards from the outside of the end lines; creases are"
        " circles of 9 feet to the outside. The rules make goal lines 2 inches wide; they are painted as wide as "
        "the rest. Not included: bench, table and coaches' areas and limit lines."
    )
    return sheet.template("lacrosse", f"Lacrosse, NCAA men's, 110 x {p.width / YARD_M:.4g} yards", source)


def _west(sheet: Sheet, y: float) -> None:
    end, goal = -LENGTH_M / 2, -LENGTH_M / 2 + GOAL_M
    area = GOAL_AREA_M / 2
    sheet.line("goal-line-west", "Goal line (west)", (goal, -GOAL_LINE_M / 2), (goal, GOAL_LINE_M / 2))
    sheet.circle("crease-west", "Goal crease (west)", (goal, 0.0), CREASE_M - sheet.half)
    front, back = -RESTRAINING_M, end + sheet.half
    sheet.line("goal-area-west-north", "Goal area (west), north side", (back, area), (front, area))
    sheet.line("restraining-line-west", "Restraining line (west)", (front, y), (front, -y))
    sheet.line("goal-area-west-south", "Goal area (west), south side", (front, -area), (back, -area))
