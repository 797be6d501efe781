"""Every field of lines, at the ends of its parameters' ranges and wherever it lies, can be driven."""

import pytest

from tests.planner.at_once import planned_at_once
from tests.with_full import with_full
from touchline.schemas.catalogue import line_templates
from touchline.schemas.fields import FIELDS
from touchline.schemas.lettering import Corners, write
from touchline.schemas.messages import PlanOptions
from touchline.schemas.placement import place
from touchline.schemas.template import Placement, Template


def extremes(end: str) -> list[tuple[str, dict[str, float | bool]]]:
    """All least or all most, and every switch turned."""
    fields = ((name, FIELDS[name].parameters) for name in line_templates())
    cases = (
        (name, {p.name: not p.default if p.least is None else getattr(p, end) for p in parameters})
        for name, parameters in fields
    )
    return [(name, values) for name, values in cases if values]


@pytest.mark.parametrize(("name", "values"), with_full(*extremes("least"), full=extremes("most")))
def test_fields_can_be_driven_at_the_ends_of_their_ranges(name: str, values: dict[str, float | bool]) -> None:
    template = place(FIELDS[name].template(values), Placement(x_m=-300, y_m=120, rotation_deg=33, mirror=True))
    report = planned_at_once(template, PlanOptions(order="given")).report
    assert report.painted_segments == len(template.segments)
    assert report.paint_length_m == pytest.approx(template.length_m, rel=0.1)


@pytest.mark.parametrize(("height", "corners"), [(0.8, Corners.CUT), (1.8288, Corners.SQUARE), (3.2, Corners.ROUND)])
def test_text_can_be_driven(height: float, corners: Corners) -> None:
    strokes = tuple(write("GO 26!", height, 0.12, corners))
    assert planned_at_once(Template(name="go", segments=strokes)).report.painted_segments == len(strokes)
