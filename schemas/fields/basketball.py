"""The basketball court of FIBA."""

import math
from typing import Annotated

from pydantic import Field

from touchline.schemas.fields.sheet import Parameters, Sheet
from touchline.schemas.template import Template

LENGTH_M, WIDTH_M, LINE_M, CIRCLE_M = 28.0, 15.0, 0.05, 1.80
BASKET_M, THREE_POINT_M, THREE_POINT_SIDE_M, NO_CHARGE_M = 1.575, 6.75, 0.90, 1.25
FREE_THROW_M, RESTRICTED_M = 5.80, 4.90
#: Rebound places beside the restricted area, from the inside of the end line: near edges of the ticks, and the block.
#: 0.85 m lie between one and the next.
PLACES_M, BLOCK_M, TICK_M = (1.75, 3.90, 4.80), (2.65, 3.05), 0.10
THROW_IN_M, OVERHANG_M = 8.325, 0.15


class Basketball(Parameters):
    """Article 2: a fixed court with lines of 5 cm."""

    rebound_places: Annotated[bool, Field(description="the marks beside the restricted areas")] = True


def basketball(p: Basketball) -> Template:
    """The court of FIBA."""
    sheet = Sheet(LINE_M)
    _west(sheet, p)
    west = list(sheet.segments)
    sheet.circle("centre-circle", "Centre circle", (0.0, 0.0), CIRCLE_M - sheet.half)
    reach = WIDTH_M / 2 + LINE_M + OVERHANG_M
    sheet.line("centre-line", "Centre line", (0.0, reach), (0.0, -reach))
    sheet.half_turn(west)
    for side, sign in (("east", 1), ("west", -1)):
        x, y = sign * (LENGTH_M / 2 - THROW_IN_M + sheet.half), WIDTH_M / 2 + LINE_M
        sheet.line(f"throw-in-line-{side}", f"Throw-in line ({side})", (x, y), (x, y + OVERHANG_M))
    sheet.boundary(LENGTH_M, WIDTH_M, ("End line", "Sideline"), inside=False)
    source = (
        "FIBA Official Basketball Rules 2024, Article 2 (Court: Dimensions and lines). Origin at the centre, x "
        "along the sidelines, y north, in m. 28 by 15 m between the inside edges of the boundary lines. Circles "
        "of 1.80 m, the 6.75 m arc and the restricted area are to the outside, the no-charge semi-circle of 1.25 "
        "m to the inside; free-throw lines have their further edge 5.80 m from the inside of the end line, and "
        "the semi-circle there is about the line's centre. The scorer's table is in the south: throw-in lines are"
        " in the north. Not included: team bench areas, painted areas."
    )
    return sheet.template("basketball", "Basketball, FIBA, 28 x 15 m", source)


def _west(sheet: Sheet, p: Basketball) -> None:
    end, half = -LENGTH_M / 2, sheet.half
    basket = (end + BASKET_M, 0.0)
    quarter = math.pi / 2
    no_charge, back = NO_CHARGE_M + half, end + 1.2
    sheet.line("no-charge-west-north", "No-charge area (west), north side", (back, no_charge), (basket[0], no_charge))
    sheet.arc_between("no-charge-west-arc", "No-charge semi-circle (west)", basket, no_charge, (quarter, -quarter))
    sheet.line("no-charge-west-south", "No-charge area (west), south side", (basket[0], -no_charge), (back, -no_charge))
    if p.rebound_places:
        _rebound_places(sheet, end)
    side, front = RESTRICTED_M / 2 - half, end + FREE_THROW_M - half
    sheet.line("restricted-west-north", "Restricted area (west), north side", (end - half, side), (front, side))
    outside = side + half
    sheet.line("free-throw-line-west", "Free-throw line (west), extended", (front, outside), (front, -outside))
    sheet.line("restricted-west-south", "Restricted area (west), south side", (front, -side), (end - half, -side))
    circle = CIRCLE_M - half
    sheet.arc_between("free-throw-arc-west", "Free-throw semi-circle (west)", (front, 0.0), circle, (quarter, -quarter))
    radius, y = THREE_POINT_M - half, WIDTH_M / 2 - THREE_POINT_SIDE_M - half
    angle = math.asin(y / radius)
    joint = basket[0] + radius * math.cos(angle)
    sheet.line("three-point-west-north", "Three-point line (west), north side", (end - half, y), (joint, y))
    sheet.arc_between("three-point-west-arc", "Three-point arc (west)", basket, radius, (angle, -angle))
    sheet.line("three-point-west-south", "Three-point line (west), south side", (joint, -y), (end - half, -y))


def _rebound_places(sheet: Sheet, end: float) -> None:
    """Ticks of 0.10 m outside the restricted area; the neutral zone is a block of 0.40 by 0.10 m."""
    low, high = RESTRICTED_M / 2, RESTRICTED_M / 2 + TICK_M
    for sign, name in ((1, "north"), (-1, "south")):
        for index, at in enumerate(PLACES_M, 1):
            x = end + at + sheet.half
            ends = ((x, sign * high), (x, sign * low))
            sheet.line(f"rebound-place-west-{name}-{index}", f"Rebound place (west, {name})", *ends)
        y = sign * (low + high) / 2
        block = ((end + BLOCK_M[0], y), (end + BLOCK_M[1], y))
        sheet.band(f"neutral-zone-west-{name}", f"Neutral zone (west, {name})", *block, TICK_M)
