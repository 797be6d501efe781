"""The rugby union ground."""

from typing import Annotated

from pydantic import Field

from touchline.schemas.fields.sheet import Parameters, Sheet, metres
from touchline.schemas.template import Template

DASH_M, CENTRE_MARK_M = 5.0, 0.5


class RugbyUnion(Parameters):
    """Law 1: the field of play and its in-goals."""

    length: Annotated[float, Field(ge=94, le=100, description="goal line to goal line, m")] = 100.0
    width: Annotated[float, Field(ge=68, le=70, description="touchline to touchline, inside, m")] = 70.0
    in_goal: Annotated[float, Field(ge=6, le=22, description="goal line to dead-ball line, m")] = 10.0
    line_width: Annotated[float, Field(ge=0.05, le=0.12, description="all lines, m; Law 1 gives none")] = 0.10


def rugby_union(p: RugbyUnion) -> Template:
    """Solid lines whole, dash lines in strokes of 5 m."""
    sheet = Sheet(p.line_width)
    half, x, y = sheet.half, p.length / 2, p.width / 2
    lines = [-(x - 22 + half), -10.0, 0.0, 10.0, x - 22 + half]
    _dashes_along(sheet, lines, x, y)
    _dashes_across(sheet, x, y)
    sheet.line("centre-mark", "Centre mark", (-CENTRE_MARK_M / 2, 0.0), (CENTRE_MARK_M / 2, 0.0))
    solid = {
        "22-metre-line-west": (-(x - 22 + half), "22-metre line (west)"),
        "halfway-line": (0.0, "Halfway line"),
        "22-metre-line-east": (x - 22 + half, "22-metre line (east)"),
        "goal-line-east": (x + half, "Goal line (east)"),
        "goal-line-west": (-x - half, "Goal line (west)"),
    }
    for index, (name, (at, label)) in enumerate(solid.items()):
        sign = -1 if index % 2 else 1
        sheet.line(name, label, (at, sign * (y + half)), (at, -sign * (y + half)))
    _ends(sheet, p)
    source = (
        "World Rugby Laws of the Game 2024, Law 1 (The Ground) and its diagram. Origin at the centre, x along the"
        " touchlines, y north, in m. The field of play is measured between the inside edges of the touchlines, "
        "which are in touch, and of the goal lines, which are in in-goal; dead-ball and touch-in-goal lines lie "
        "outside in-goal; the 22-metre lines belong to the 22. 10-, 15- and 5-metre lines are centred on their "
        "distances. Each dash is 5 m long: along the field at the halfway, 10- and 22-metre lines and from the "
        "5-metre line onwards; across it at 5 and 15 m from touch and three between on the 10-metre lines. Below "
        "100 m the distance between the 10- and the 22-metre lines shrinks, as Law 1 says. The line width is "
        "custom, 0.10 m."
    )
    title = f"Rugby union, {metres(p.length)} x {metres(p.width)} m, in-goal {metres(p.in_goal)} m"
    return sheet.template("rugby-union", title, source)


def _dashes_along(sheet: Sheet, lines: list[float], x: float, y: float) -> None:
    """The 5- and 15-metre lines parallel to touch, there and back."""
    middles = [-(x - 5 - DASH_M / 2), *lines, x - 5 - DASH_M / 2]
    rows = [("5-metre-line-south", 5 - y), ("15-metre-line-south", 15 - y)]
    rows += [("15-metre-line-north", y - 15), ("5-metre-line-north", y - 5)]
    for row, (name, at) in enumerate(rows):
        sign = 1 if row % 2 == 0 else -1
        for index, middle in enumerate(middles[::sign], 1):
            ends = ((middle - sign * DASH_M / 2, at), (middle + sign * DASH_M / 2, at))
            sheet.line(f"{name}-{index}", f"{name.replace('-', ' ').capitalize()}, dash", *ends)


def _dashes_across(sheet: Sheet, x: float, y: float) -> None:
    """The 10-metre lines and the lines 5 m from the goal lines."""
    outer = [5 - y, 15 - y, y - 15, y - 5]
    gap = (y - 15) / 2
    full = sorted([*outer, -gap, 0.0, gap])
    rows = [("5-metre-goal-line-west", 5 - x, outer), ("10-metre-line-west", -10.0, full)]
    rows += [("10-metre-line-east", 10.0, full), ("5-metre-goal-line-east", x - 5, outer)]
    for row, (name, at, middles) in enumerate(rows):
        sign = 1 if row % 2 == 0 else -1
        for index, middle in enumerate(middles[::sign], 1):
            ends = ((at, middle - sign * DASH_M / 2), (at, middle + sign * DASH_M / 2))
            sheet.line(f"{name}-{index}", f"{name.replace('-', ' ').capitalize()}, dash", *ends)


def _ends(sheet: Sheet, p: RugbyUnion) -> None:
    """Dead-ball lines, and each touchline with its two touch-in-goal lines as one stroke, clockwise."""
    start = len(sheet.segments)
    sheet.boundary(p.length + 2 * p.in_goal, p.width, ("Dead-ball line", "Touchline"), inside=False)
    for index in range(start, len(sheet.segments)):
        stroke = sheet.segments[index]
        if stroke.id.startswith("touchline"):
            label = stroke.label.replace("Touchline", "Touchline and touch-in-goal lines")
            sheet.segments[index] = stroke.model_copy(update={"label": label})
