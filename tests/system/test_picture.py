"""The picture of what was painted: coloured by how far off it is."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from touchline.jobs.single.painted_picture import draw_painted, lateral_error
from touchline.schemas.curves import Curve
from touchline.schemas.messages import PaintMarks
from touchline.schemas.template import ArcSpec, LineSpec, Polygon, Template, TemplateSegment

LINE = Curve.from_line((0.0, 0.0), (0.0, 10.0))


def test_off_a_line_and_beyond_its_end():
    points = np.array([(0.0, 5.0), (-0.02, 5.0), (0.03, 12.0)])
    assert lateral_error(LINE, points) == pytest.approx([0.0, 0.02, -0.03])


@pytest.mark.parametrize("sweep", [1.0, -1.0])
def test_off_an_arc_by_the_radius(sweep):
    arc = Curve.from_arc((5.0, 0.0), (0.0, 0.0), sweep)
    angles = sweep * np.array([0.0, 0.4, 0.9])
    radii = np.array([5.0, 5.02, 4.97])
    points = np.column_stack((radii * np.cos(angles), radii * np.sin(angles)))
    assert lateral_error(arc, points) == pytest.approx(math.copysign(1.0, sweep) * np.array([0.0, -0.02, 0.03]))


def colours(path: Path, *offsets_m: float) -> set[str]:
    """The strokes' colours in the picture of a line painted in steps that are off by so much."""
    template = Template(
        name="two",
        segments=(
            TemplateSegment(id="a", line=LineSpec(start=(0.0, 0.0), end=(10.0, 0.0)), actuation="SPRAY"),
            TemplateSegment(id="b", arc=ArcSpec(start=(5, 0), center=(0, 0), sweep_angle=1.0), actuation="SPRAY"),
        ),
    )
    strokes = [
        PaintMarks(segment_id="a", width_m=0.12, x_m=[i, i + 0.5, i + 1.0], y_m=[off] * 3)
        for i, off in enumerate(offsets_m)
    ]
    draw_painted(template, strokes, path)
    collections = re.findall(r'<g id="LineCollection_\d+">.*?</g>', path.read_text(), flags=re.DOTALL)
    return {colour for text in collections for colour in re.findall(r"stroke: (#[0-9a-f]{6})", text)}


def test_obstacles_are_drawn(tmp_path):
    line = TemplateSegment(id="a", line=LineSpec(start=(0.0, 0.0), end=(10.0, 0.0)), actuation="SPRAY")
    post = Polygon(id="post", corners=((5.0, 0.0), (5.1, 0.0), (5.1, 0.1)))
    draw_painted(Template(name="one", segments=(line,), obstacles=(post,)), [], tmp_path / "a.svg")
    assert 'id="obstacles"' in (tmp_path / "a.svg").read_text()


def test_right_is_white_and_wrong_is_red(tmp_path):
    assert colours(tmp_path / "a.svg", 0.0, -0.05, 0.2) == {"#ffffff", "#e0202a"}
    (between,) = colours(tmp_path / "b.svg", 0.01)
    assert between not in ("#ffffff", "#e0202a")
