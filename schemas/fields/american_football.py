"""The American football field of the NCAA."""

from typing import Annotated

from pydantic import Field

from touchline.schemas.fields.sheet import FOOT_M, INCH_M, YARD_M, Parameters, Sheet
from touchline.schemas.lettering import Corners, write
from touchline.schemas.placement import Transform
from touchline.schemas.template import Template

LENGTH_M, WIDTH_M, END_ZONE_M = 120 * YARD_M, 160 * FOOT_M, 10 * YARD_M
HASH_M, HASH_GAP_M, SIDELINE_GAP_M = 24 * INCH_M, 40 * FOOT_M, 4 * INCH_M
NUMBER_HEIGHT_M, NUMBER_WIDTH_M, NUMBER_TOP_M = 6 * FOOT_M, 4 * FOOT_M, 9 * YARD_M
#: From a yard line's centre to the digits at its sides, and on to the arrow.
DIGIT_GAP_M, ARROW_GAP_M = 1 * FOOT_M, 0.5 * FOOT_M
ARROW_BASE_M, ARROW_SIDE_M = 18 * INCH_M, 36 * INCH_M


class AmericanFootball(Parameters):
    """Rule 1-2: a fixed field; what is recommended rather than required can be left out."""

    line_width: Annotated[float, Field(ge=0.1, le=0.104, description="all lines (4 inches), m")] = 4 * INCH_M
    goal_line_width: Annotated[float, Field(ge=0.1, le=0.2032, description="goal lines (4 to 8 inches), m")] = (
        4 * INCH_M
    )
    hash_marks: Annotated[bool, Field(description="24-inch marks at every yard, in four rows")] = True
    numbers: Annotated[bool, Field(description="yard-line numbers, 6 by 4 feet")] = True
    arrows: Annotated[bool, Field(description="directional arrows beside the numbers, in outline")] = True


def american_football(p: AmericanFootball) -> Template:
    """The NCAA field: hash marks 40 feet apart."""
    sheet = Sheet(p.line_width)
    if p.numbers:
        _numbers(sheet, p.arrows)
    if p.hash_marks:
        _hash_marks(sheet)
    _yard_lines(sheet)
    for side, sign in (("west", -1), ("east", 1)):
        y, goal = WIDTH_M / 2, sign * (LENGTH_M / 2 - END_ZONE_M + p.goal_line_width / 2)
        try_x = sign * (LENGTH_M / 2 - END_ZONE_M - 3 * YARD_M)
        sheet.line(f"try-mark-{side}", f"Try mark ({side})", (try_x, HASH_M / 2), (try_x, -HASH_M / 2))
        sheet.band(f"goal-line-{side}", f"Goal line ({side})", (goal, -y * sign), (goal, y * sign), p.goal_line_width)
    sheet.boundary(LENGTH_M, WIDTH_M, ("End line", "Sideline"), inside=False)
    source = (
        "NCAA Football Rules 2024, Rule 1, Section 2 and Appendix D. Origin at the centre of the field, x along "
        "the sidelines, y north, in m. 120 by 53 1/3 yards between the inside edges of the sidelines and end "
        "lines, which are out of bounds; the goal lines lie in the end zones. Yard lines every 5 yards end 4 "
        "inches from the sidelines. Hash marks and sideline extensions are 24 inches long at every yard between; "
        "the hash marks' inner ends are 40 feet apart (60 feet from either sideline). Numbers are 6 by 4 feet in "
        "straight strokes, their tops 9 yards from the sidelines. Arrows are drawn in outline: base 18, sides 36 "
        "inches. Not included: team and coaching areas, limit lines, the restraining line, end-zone decoration."
    )
    return sheet.template("american-football", "American football, NCAA, 120 x 53 1/3 yards", source)


def _yard_lines(sheet: Sheet) -> None:
    """Every 5 yards between the goal lines, up and down in turn."""
    reach = WIDTH_M / 2 - SIDELINE_GAP_M
    for index, yard in enumerate(range(-45, 50, 5)):
        sign = 1 if index % 2 else -1
        ends = ((yard * YARD_M, sign * reach), (yard * YARD_M, -sign * reach))
        sheet.line(f"yard-line-{_name(yard)}", f"Yard line ({_spoken(yard)})", *ends)


def _hash_marks(sheet: Sheet) -> None:
    """Four rows, one after another, there and back."""
    edge, hash_y = WIDTH_M / 2 - SIDELINE_GAP_M, HASH_GAP_M / 2
    rows = {
        "sideline-south": (-edge, -edge + HASH_M),
        "hash-south": (-hash_y - HASH_M, -hash_y),
        "hash-north": (hash_y, hash_y + HASH_M),
        "sideline-north": (edge - HASH_M, edge),
    }
    yards = [yard for yard in range(-49, 50) if yard % 5]
    for index, (row, (low, high)) in enumerate(rows.items()):
        for yard in yards if index % 2 == 0 else reversed(yards):
            x = yard * YARD_M
            sheet.line(f"{row}-{_name(yard)}", f"{row.replace('-', ' ').capitalize()} mark", (x, low), (x, high))


def _numbers(sheet: Sheet, arrows: bool) -> None:
    """The south row reads from the south sideline; the north row is the same, turned round."""
    for yard in range(-40, 50, 10):
        _number(sheet, yard, arrows)
    sheet.half_turn([s for s in sheet.segments if s.id.startswith("number-south")])


def _number(sheet: Sheet, yard: int, arrows: bool) -> None:
    x, bottom = yard * YARD_M, -WIDTH_M / 2 + NUMBER_TOP_M - NUMBER_HEIGHT_M
    name = f"number-south-{_name(yard)}"
    digits = str(50 - abs(yard))
    for digit, left in zip(digits, (x - DIGIT_GAP_M - NUMBER_WIDTH_M, x + DIGIT_GAP_M), strict=True):
        strokes = write(digit, NUMBER_HEIGHT_M, sheet.line_width_m, Corners.SQUARE, width_m=NUMBER_WIDTH_M)
        side = "tens" if left < x else "ones"
        move = Transform.of(left, bottom, 0.0)
        for index, stroke in enumerate(strokes, 1):
            moved = move.segment(stroke)
            sheet.segments.append(
                moved.model_copy(update={"id": f"{name}-{side}-{index}", "label": f"Number {digits} ({_spoken(yard)})"})
            )
    if arrows and yard:
        sign = 1 if yard > 0 else -1
        base_x = x + sign * (DIGIT_GAP_M + NUMBER_WIDTH_M + ARROW_GAP_M)
        tip_x = base_x + sign * (ARROW_SIDE_M**2 - (ARROW_BASE_M / 2) ** 2) ** 0.5
        middle = bottom + NUMBER_HEIGHT_M - ARROW_BASE_M / 2 - sheet.half
        corners = [(base_x, middle - ARROW_BASE_M / 2), (base_x, middle + ARROW_BASE_M / 2), (tip_x, middle)]
        for index, start in enumerate(corners):
            end = corners[(index + 1) % 3]
            sheet.line(f"{name}-arrow-{index + 1}", f"Arrow ({_spoken(yard)})", start, end)


def _name(yard: int) -> str:
    """The yard line's number and its half: ``west-35``, ``50``, ``east-35``."""
    half = "" if yard == 0 else "west-" if yard < 0 else "east-"
    return f"{half}{50 - abs(yard)}"


def _spoken(yard: int) -> str:
    return _name(yard).replace("-", " ")
