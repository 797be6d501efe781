"""The planning study's square."""

from touchline.schemas.fields.sheet import Parameters, Sheet
from touchline.schemas.template import Template


class Square(Parameters):
    """The study's square has no parameters."""


def study_square(_: Square) -> Template:
    """1 × 1 m, clockwise from the south-west corner."""
    sheet = Sheet(0.12)
    corners = [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)]
    for side, start, end in zip(("west", "north", "east", "south"), corners, corners[1:], strict=False):
        sheet.line(f"side-{side}", f"Side ({side})", start, end)
    source = (
        "The 1 x 1 m square of the planning study. Origin at the south-west corner, x east, y north, in m; the "
        "sides are the centres of the painted strokes, clockwise."
    )
    return sheet.template("study-square", "Square of the study, 1 x 1 m", source)
