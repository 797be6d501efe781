"""Soccer pitches: 11-a-side by the Laws of the Game, 9- and 7-a-side by the FA's guide."""

import math
from dataclasses import dataclass, replace
from typing import Annotated, Self

from pydantic import Field, model_validator

from touchline.schemas.fields.sheet import YARD_M, Parameters, Sheet, metres, rectangle
from touchline.schemas.template import Area, Polygon, Template

LineWidth = Annotated[float, Field(ge=0.05, le=0.12, description="all lines, m")]
MARK_M = 0.24


class _Longer(Parameters):
    """The touchline is longer than the goal line (Law 1)."""

    length: float
    width: float

    @model_validator(mode="after")
    def _longer_than_wide(self) -> Self:
        if self.length <= self.width:
            raise ValueError(f"the length ({self.length:g} m) must be greater than the width ({self.width:g} m)")
        return self


class Soccer11(_Longer):
    """IFAB Law 1; international matches: 100 to 110 m by 64 to 75 m."""

    length: Annotated[float, Field(ge=90, le=120, description="touchlines, outside to outside, m")] = 105.0
    width: Annotated[float, Field(ge=45, le=90, description="goal lines, outside to outside, m")] = 68.0
    line_width: LineWidth = 0.12


class Soccer11Grass(_Longer):
    """The same pitch and what is mown round it."""

    length: Annotated[float, Field(ge=90, le=120, description="touchlines, outside to outside, m")] = 105.0
    width: Annotated[float, Field(ge=45, le=90, description="goal lines, outside to outside, m")] = 68.0
    run_off: Annotated[float, Field(ge=1, le=10, description="grass beyond the lines, all round, m")] = 3.0


class Soccer9(_Longer):
    """The FA's 9 v 9 pitch, 80 by 50 yards; the range is ± 10 yards."""

    length: Annotated[float, Field(ge=64.0, le=82.3, description="touchlines, outside to outside, m")] = 80 * YARD_M
    width: Annotated[float, Field(ge=36.5, le=54.9, description="goal lines, outside to outside, m")] = 50 * YARD_M
    line_width: LineWidth = 0.12
    full: Annotated[bool, Field(description="also goal areas, penalty arcs and corner arcs")] = True


class Soccer7(_Longer):
    """The FA's 7 v 7 pitch, 60 by 40 yards; the range is ± 10 yards."""

    length: Annotated[float, Field(ge=45.7, le=64.1, description="touchlines, outside to outside, m")] = 60 * YARD_M
    width: Annotated[float, Field(ge=27.4, le=45.8, description="goal lines, outside to outside, m")] = 40 * YARD_M
    line_width: LineWidth = 0.12


@dataclass(frozen=True)
class _Marks:
    """Dimensions (m) of what is inside a pitch; areas are (depth, width); 0 radius: not painted."""

    areas: dict[str, tuple[float, float]]
    penalty_mark: float
    circle_radius: float
    penalty_arc_radius: float
    corner_radius: float


_GOAL_M = 7.32
_LAW_1 = _Marks(
    areas={"Goal": (5.5, _GOAL_M + 11.0), "Penalty": (16.5, _GOAL_M + 33.0)},
    penalty_mark=11.0,
    circle_radius=9.15,
    penalty_arc_radius=9.15,
    corner_radius=1.0,
)
_FA_9 = _Marks(
    areas={"Goal": (4 * YARD_M, 14 * YARD_M), "Penalty": (13 * YARD_M, 32 * YARD_M)},
    penalty_mark=9 * YARD_M,
    circle_radius=7 * YARD_M,
    penalty_arc_radius=7 * YARD_M,
    corner_radius=1 * YARD_M,
)
_FA_7 = _Marks(
    areas={"Penalty": (10 * YARD_M, 18 * YARD_M)},
    penalty_mark=8 * YARD_M,
    circle_radius=6 * YARD_M,
    penalty_arc_radius=0.0,
    corner_radius=0.0,
)

_HOW = (
    "Origin at the centre of the pitch, x east along the touchlines, y north, in m. Dimensions are to the outside of "
    "the lines, so the lines given here, the centres of the painted strokes, run half a line width inside them; the "
    "penalty marks are {mark} m from the outside of the goal line. Lines run up to the centre of the line they join; "
    "touchlines and area fronts fill their corners. Marks are strokes of 0.24 m. The order and the clockwise "
    "directions suit a nozzle on the right-hand side."
)
_FA = "The FA, Guide to Pitch and Goalpost Dimensions (2012), {game} pitch; ranges are 10 yards either way. "


def soccer_11(p: Soccer11) -> Template:
    """11-a-side."""
    source = "IFAB Laws of the Game 2024/25, Law 1 (The Field of Play). " + _HOW.format(mark="11")
    return _pitch("soccer-11", "Soccer, 11-a-side", source, p, p.line_width, _LAW_1)


def soccer_11_grass(p: Soccer11Grass) -> Template:
    """All of the grass that `soccer-11` is painted on, to be mown or rolled."""
    corners = rectangle(p.length + 2 * p.run_off, p.width + 2 * p.run_off)
    pitch, run_off = f"{metres(p.length)} x {metres(p.width)} m", f"{metres(p.run_off)} m of run-off"
    source = (
        "IFAB Laws of the Game 2024/25, Law 1 (The Field of Play), for length and width; how much grass there is "
        "beyond the lines is up to the ground. Origin at the centre of the pitch, x east along the touchlines, y "
        "north, in m. The boundary is the edge of the grass; goals and corner flags are off it while it is worked."
    )
    return Template(
        name="soccer-11-grass",
        title=f"Grass of a soccer pitch, {pitch} and {run_off}",
        source=source,
        areas=(Area(id="grass", outline=corners),),
        boundary=Polygon(corners=corners),
    )


def soccer_9(p: Soccer9) -> Template:
    """9-a-side."""
    source = _FA.format(game="9 v 9") + _HOW.format(mark="8.23 (9 yards)")
    marks = _FA_9
    if not p.full:
        areas = {"Penalty": _FA_9.areas["Penalty"]}
        marks = replace(_FA_9, areas=areas, penalty_arc_radius=0.0, corner_radius=0.0)
    return _pitch("soccer-9", "Soccer, 9-a-side", source, p, p.line_width, marks)


def soccer_7(p: Soccer7) -> Template:
    """7-a-side."""
    source = _FA.format(game="7 v 7") + _HOW.format(mark="7.32 (8 yards)")
    return _pitch("soccer-7", "Soccer, 7-a-side", source, p, p.line_width, _FA_7)


def _pitch(name: str, title: str, source: str, p: _Longer, line_width: float, marks: _Marks) -> Template:
    sheet = Sheet(line_width)
    y = p.width / 2 - sheet.half
    _west(sheet, p, marks)
    west = list(sheet.segments)
    sheet.line("centre-mark", "Centre mark", (-MARK_M / 2, 0.0), (MARK_M / 2, 0.0))
    sheet.circle("centre-circle", "Centre circle", (0.0, 0.0), marks.circle_radius - sheet.half)
    sheet.line("halfway-line", "Halfway line", (0.0, y), (0.0, -y))
    sheet.half_turn(west)
    sheet.boundary(p.length, p.width, ("Goal line", "Touchline"), inside=True)
    return sheet.template(name, f"{title}, {metres(p.length)} x {metres(p.width)} m", source)


def _west(sheet: Sheet, p: _Longer, marks: _Marks) -> None:
    edge, half = -p.length / 2, sheet.half
    if marks.corner_radius:
        _corner_arcs(sheet, p, marks.corner_radius - half)
    mark = edge + marks.penalty_mark
    sheet.line("penalty-mark-west", "Penalty mark (west)", (mark - MARK_M / 2, 0.0), (mark + MARK_M / 2, 0.0))
    if marks.penalty_arc_radius:
        radius, front = marks.penalty_arc_radius - half, edge + marks.areas["Penalty"][0] - half
        angle = math.acos((front - mark) / radius)
        start = (front, math.sqrt(radius**2 - (front - mark) ** 2))
        sheet.arc("penalty-arc-west", "Penalty arc (west)", start, (mark, 0.0), -2 * angle)
    for area, (depth, width) in marks.areas.items():
        outside, front = width / 2, edge + depth - half
        side = outside - half
        name, label = f"{area.lower()}-area-west", f"{area} area (west)"
        sheet.line(f"{name}-north", f"{label}, north side", (edge + half, side), (front, side))
        sheet.line(f"{name}-front", f"{label}, front", (front, outside), (front, -outside))
        sheet.line(f"{name}-south", f"{label}, south side", (front, -side), (edge + half, -side))


def _corner_arcs(sheet: Sheet, p: _Longer, radius: float) -> None:
    """Quarter circles about the pitch's corners, between the centres of the boundary lines."""
    x, y, half = p.length / 2, p.width / 2, sheet.half
    reach = math.sqrt(radius**2 - half**2)
    sweep = -(math.pi / 2 - 2 * math.asin(half / radius))
    north, south = (-x + reach, y - half), (-x + half, -y + reach)
    sheet.arc("corner-arc-north-west", "Corner arc (north-west)", north, (-x, y), sweep)
    sheet.arc("corner-arc-south-west", "Corner arc (south-west)", south, (-x, -y), sweep)
