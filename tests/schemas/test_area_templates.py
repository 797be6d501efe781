"""The shipped fields that are areas: where their corners are, what they keep the machine to, and how they are drawn."""

import pytest
import shapely

from touchline.drawings.picture import picture
from touchline.schemas.catalogue import line_templates, load_template, shipped_templates
from touchline.schemas.errors import SpecError
from touchline.schemas.placement import place
from touchline.schemas.template import Placement, Template

AREAS = ("salt-pan", "salt-pan-l", "salt-pan-pond", "soccer-11-grass")


def test_they_are_those_that_are_not_of_lines() -> None:
    assert set(shipped_templates()) - set(line_templates()) == set(AREAS)


def test_the_pan_begins_where_the_study_does() -> None:
    (area,) = load_template("salt-pan").areas
    assert (-46.5, 23.8) in area.outline
    assert area.polygon.area == pytest.approx(93 * 47.6)


def test_the_other_pans_and_the_grass_are_as_large_as_they_say() -> None:
    assert load_template("salt-pan-l").area_m2 == pytest.approx(93 * 47.6 - 40 * 22)
    assert load_template("salt-pan-l", {"cut_length": 10, "cut_width": 8}).area_m2 == pytest.approx(93 * 47.6 - 80)
    pond = load_template("salt-pan-pond", {"pond": 12})
    (area,) = pond.areas
    assert area.holes == (pond.obstacles[0].corners,)
    assert 93 * 47.6 - area.polygon.area == pytest.approx(3.1416 * 6**2, rel=0.02)
    assert load_template("soccer-11-grass", {"run_off": 2.5}).area_m2 == pytest.approx(110 * 73)


@pytest.mark.parametrize("name", AREAS)
def test_the_boundary_is_the_edge_and_goes_where_the_drawing_goes(name: str) -> None:
    there = place(load_template(name), Placement(x_m=80, y_m=-20, rotation_deg=30, mirror=True))
    assert there.boundary is not None
    assert there.boundary.corners == there.areas[0].outline
    assert tuple(obstacle.corners for obstacle in there.obstacles) == there.areas[0].holes
    middle = shapely.Polygon(there.boundary.corners).envelope.centroid
    assert middle.distance(shapely.Point(80, -20)) < 12.0


@pytest.mark.parametrize(
    ("name", "values", "problem"),
    [
        ("salt-pan-l", {"cut_length": 80}, r"cut_length must be at most 79 m"),
        ("salt-pan-l", {"width": 20}, r"cut_width must be at most 6 m"),
        ("salt-pan-pond", {"pond": 27}, r"at most 26.5 m wide"),
        ("soccer-11-grass", {"length": 90, "width": 90}, "must be greater than the width"),
    ],
)
def test_what_leaves_no_room_is_refused(name: str, values: dict[str, float], problem: str) -> None:
    with pytest.raises(SpecError, match=problem):
        load_template(name, values)


def test_a_picture_shows_what_the_body_keeps_to() -> None:
    def paths(template: Template) -> int:
        return picture(template).count("stroke-dasharray")

    assert paths(load_template("salt-pan-pond")) == 1
    assert paths(load_template("tennis")) == 0
