"""Letters and digits as single strokes of lines and arcs.

Every glyph is drawn on a grid 4 wide and 6 high with square corners; soft corners are then cut or rounded by one grid
unit. Square strokes suit any robot; rounded ones need a grid unit of at least the robot's smallest radius.
"""

import itertools
import math
from enum import StrEnum

from touchline.schemas.errors import SpecError
from touchline.schemas.placement import Transform
from touchline.schemas.template import ArcSpec, LineSpec, TemplateSegment

Point = tuple[float, float]

#: Grid units of a glyph, and between two glyphs.
COLUMNS, ROWS, SPACE = 4.0, 6.0, 1.5
MAX_CHARACTERS = 200


class Corners(StrEnum):
    """Ways to draw soft corners."""

    SQUARE = "square"
    CUT = "cut"
    ROUND = "round"


#: Strokes of grid points (column, row from below); ``~`` marks a soft corner.
_GLYPHS = {
    "A": ("00 06~ 46~ 40", "03 43"),
    "B": ("00 06 46~ 40~ 00", "03 43"),
    "C": ("46 06~ 00~ 40",),
    "D": ("00 06 46~ 40~ 00",),
    "E": ("46 06 00 40", "03 33"),
    "F": ("46 06 00", "03 33"),
    "G": ("46 06~ 00~ 40 43 23",),
    "H": ("06 00", "40 46", "03 43"),
    "I": ("26 20",),
    "J": ("46 40~ 00~ 02",),
    "K": ("06 00", "46 03 40"),
    "L": ("06 00 40",),
    "M": ("00 06 23 46 40",),
    "N": ("00 06 40 46",),
    "O": ("06~ 46~ 40~ 00~ 06",),
    "P": ("00 06 46~ 43~ 03",),
    "Q": ("06~ 46~ 40~ 00~ 06", "22 40"),
    "R": ("00 06 46~ 43~ 03", "23 40"),
    "S": ("46 06~ 03~ 43~ 40~ 00",),
    "T": ("06 46", "26 20"),
    "U": ("06 00~ 40~ 46",),
    "V": ("06 20 46",),
    "W": ("06 00 23 40 46",),
    "X": ("00 46", "06 40"),
    "Y": ("06 23 46", "23 20"),
    "Z": ("06 46 00 40",),
    "0": ("06~ 46~ 40~ 00~ 06",),
    "1": ("20 26",),
    "2": ("06 46~ 43~ 03~ 00 40",),
    "3": ("06 46~ 40~ 00", "13 43"),
    "4": ("06 03 43", "46 40"),
    "5": ("46 06 03 43~ 40~ 00",),
    "6": ("46 06~ 00~ 40~ 43~ 03",),
    "7": ("06 46 20",),
    "8": ("06~ 46~ 40~ 00~ 06", "03 43"),
    "9": ("00 40~ 46~ 06~ 03~ 43",),
    "-": ("13 33",),
    "+": ("13 33", "22 24"),
    "/": ("00 46",),
    "!": ("26 22", "21 20"),
    ".": ("21 20",),
    ":": ("25 24", "22 21"),
    "'": ("26 24",),
}

CHARACTERS = "".join(sorted(_GLYPHS)) + " "


def write(
    text: str,
    height_m: float,
    line_width_m: float,
    corners: Corners = Corners.CUT,
    width_m: float | None = None,
) -> list[TemplateSegment]:
    """The strokes of ``text``, from the lower left corner of its first letter, reading along x.

    Args:
        text: Capital letters, digits and a few signs; small letters are written as capitals.
        height_m: Of the letters, to the outside of the strokes.
        line_width_m: Of the strokes.
        corners: Ways to draw soft corners.
        width_m: Of one letter, to the outside of the strokes; two thirds of the height by default.

    Raises:
        SpecError: A character has no glyph, there is nothing to write, or the height leaves no room for the strokes.
    """
    width_m = height_m * COLUMNS / ROWS if width_m is None else width_m
    unit = ((width_m - line_width_m) / COLUMNS, (height_m - line_width_m) / ROWS)
    _check(text, unit, line_width_m)
    strokes: list[TemplateSegment] = []
    left = 0.0
    for index, character in enumerate(text.upper()):
        move = Transform.of(left + line_width_m / 2, line_width_m / 2, 0.0)
        for part, stroke in enumerate(_letter(character, unit, line_width_m, corners), 1):
            name = f"letter-{index + 1}-{part}"
            strokes.append(move.segment(stroke.model_copy(update={"id": name, "label": f"Letter {character}"})))
        left += width_m + SPACE * unit[0]
    return strokes


def _check(text: str, unit: Point, line_width_m: float) -> None:
    unknown = sorted({character for character in text.upper() if character not in CHARACTERS})
    if unknown:
        raise SpecError("text", "", f"has no glyph for {' '.join(unknown)}", f"use only: {CHARACTERS.strip()}")
    if not text.strip() or len(text) > MAX_CHARACTERS:
        raise SpecError("text", "", f"has {len(text.strip())} characters", f"give 1 to {MAX_CHARACTERS}")
    if min(unit) < line_width_m / 2:
        need = line_width_m / 2 * ROWS + line_width_m
        raise SpecError(
            "text", "height", "leaves the strokes no room", f"give at least {need:.2f} m, or a thinner line"
        )


def _letter(character: str, unit: Point, line_width_m: float, corners: Corners) -> list[TemplateSegment]:
    strokes: list[TemplateSegment] = []
    for glyph in _GLYPHS.get(character, ()):
        strokes += _stroke(glyph, unit, line_width_m, corners)
    return strokes


def _stroke(glyph: str, unit: Point, line_width_m: float, corners: Corners) -> list[TemplateSegment]:
    """The pieces of one stroke; upright and level ends grow by half a width, to the outside of what they meet."""
    words = glyph.split()
    points = [(float(word[0]) * unit[0], float(word[1]) * unit[1]) for word in words]
    soft = [len(word) > 2 and corners is not Corners.SQUARE for word in words]
    closed, half = points[0] == points[-1], line_width_m / 2
    # A soft corner takes the same length from both sides, so that an arc can touch them.
    cut = min(unit)
    here = points[0]
    if closed and soft[0]:
        here = _towards(points[0], points[1], cut)
    elif not closed and _level(points[0], points[1]):
        here = _beyond(points[1], points[0], half)
    pieces: list[TemplateSegment] = []
    for index, (before, corner) in enumerate(itertools.pairwise(points), 1):
        ends = index == len(points) - 1
        bends = soft[0] if ends and closed else soft[index] and not ends
        if not bends:
            pieces.append(_line(here, _beyond(here, corner, half) if _level(before, corner) else corner))
            here = corner
            continue
        onward = _towards(corner, points[1] if ends else points[index + 1], cut)
        reach = _towards(corner, before, cut)
        pieces.append(_line(here, reach))
        pieces.append(_arc(reach, corner, onward) if corners is Corners.ROUND else _line(reach, onward))
        here = onward
    return pieces


def _line(start: Point, end: Point) -> TemplateSegment:
    return TemplateSegment(id="stroke", line=LineSpec(start=start, end=end))


def _arc(start: Point, corner: Point, end: Point) -> TemplateSegment:
    """The arc that touches both sides of a corner at the same distance from it."""
    first = (start[0] - corner[0], start[1] - corner[1])
    second = (end[0] - corner[0], end[1] - corner[1])
    cross = first[0] * second[1] - first[1] * second[0]
    dot = first[0] * second[0] + first[1] * second[1]
    inner = abs(math.atan2(cross, dot))
    reach = math.hypot(*first) / math.cos(inner / 2)
    middle = (first[0] + second[0], first[1] + second[1])
    scale = reach / math.hypot(*middle)
    center = (corner[0] + scale * middle[0], corner[1] + scale * middle[1])
    sweep = math.copysign(math.pi - inner, -cross)
    return TemplateSegment(id="stroke", arc=ArcSpec(start=start, center=center, sweep_angle=sweep))


def _level(start: Point, end: Point) -> bool:
    return start[0] == end[0] or start[1] == end[1]


def _towards(start: Point, end: Point, length: float) -> Point:
    share = length / math.dist(start, end)
    return (start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1]))


def _beyond(start: Point, end: Point, length: float) -> Point:
    return _towards(end, (2 * end[0] - start[0], 2 * end[1] - start[1]), length)
