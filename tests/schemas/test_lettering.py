"""Text: right size, strokes that join, nothing that cannot be written."""

import math
from itertools import product

import numpy as np
import pytest
from shapely import LineString
from shapely.ops import unary_union

from touchline.schemas.errors import SpecError
from touchline.schemas.lettering import CHARACTERS, Corners, write
from touchline.schemas.template import Template, TemplateSegment

WIDTH_M = 0.12


#: Letters with slanting ends, whose corners stick out or fall short by less than a line.
SLANTED = "KMNQRVWXYZ7"


def extent(strokes: list[TemplateSegment]) -> tuple[float, float, float, float]:
    """Bounds of the paint."""
    lines = [
        LineString(np.column_stack(s.curve().at(np.linspace(0.0, s.curve().length_m, 2 if s.line else 99))[:2]))
        for s in strokes
    ]
    return unary_union([line.buffer(WIDTH_M / 2, cap_style="flat") for line in lines]).bounds


def test_letters_are_as_high_as_asked() -> None:
    for character, corners in product(filter(str.isalnum, CHARACTERS), Corners):
        low_x, low_y, high_x, high_y = extent(write(character, 3.0, WIDTH_M, corners))
        slack = WIDTH_M if character in SLANTED else 1e-9
        assert low_y == pytest.approx(0.0, abs=slack), (character, corners)
        assert high_y == pytest.approx(3.0, abs=slack), (character, corners)
        assert low_x >= -slack and high_x <= 2.0 + slack, (character, corners)


def test_digits_for_yard_numbers_are_straight_and_of_their_size() -> None:
    for digit in "012345":
        strokes = write(digit, 1.8288, 0.1016, Corners.SQUARE, width_m=1.2192)
        assert all(stroke.line is not None for stroke in strokes)
        xs = [x for s in strokes for x in (s.curve().x_m, s.curve().end[0])]
        ys = [y for s in strokes for y in (s.curve().y_m, s.curve().end[1])]
        assert min(xs) >= 0.0 and max(xs) <= 1.2192
        assert min(ys) == pytest.approx(0.0, abs=0.0509) and max(ys) == pytest.approx(1.8288, abs=0.0509)


def test_round_corners_touch_both_sides() -> None:
    strokes = write("O", 6.12, WIDTH_M, Corners.ROUND, width_m=4.12)
    assert [stroke.arc is not None for stroke in strokes].count(True) == 4
    ends = [(s.curve().end, s.curve()) for s in strokes]
    for (end, _), (_, following) in zip(ends, ends[1:] + ends[:1], strict=True):
        assert end[:2] == pytest.approx((following.x_m, following.y_m), abs=1e-9)
        assert math.remainder(end[2] - following.heading_rad, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
    radii = {round(1 / abs(s.curve().curvature_1pm), 9) for s in strokes if s.arc}
    assert radii == {1.0}


def test_cut_corners_are_straight_at_any_height() -> None:
    for height in (0.6, 2.0, 20.0):
        assert all(stroke.line is not None for stroke in write("SOCCER 09", height, 0.05, Corners.CUT))


def test_words_go_along_x_and_small_letters_become_capitals() -> None:
    strokes = write("Go", 2.0, WIDTH_M)
    assert strokes == write("GO", 2.0, WIDTH_M)
    first, second = (extent([s for s in strokes if s.id.startswith(f"letter-{i}")]) for i in (1, 2))
    assert second[0] > first[2] + WIDTH_M
    assert Template(name="go", segments=tuple(strokes)).length_m > 5.0


@pytest.mark.parametrize(
    ("text", "height", "says"),
    [("GRÜN", 2.0, "no glyph for Ü; use only"), ("  ", 2.0, "has 0 characters"), ("GO", 0.3, "give at least 0.48 m")],
)
def test_what_cannot_be_written_is_told(text: str, height: float, says: str) -> None:
    with pytest.raises(SpecError, match=says):
        write(text, height, WIDTH_M)
