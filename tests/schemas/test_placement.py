"""Placement: rigid motions keep what they must, and the earth is where it is."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from touchline.core.geodesy import FLATTENING, SEMI_MAJOR_M
from touchline.schemas.catalogue import load_template, parse_template, placed
from touchline.schemas.errors import SpecError
from touchline.schemas.placement import Transform, offset_m, place, same_place, to_map
from touchline.schemas.scenario import Origin
from touchline.schemas.template import ArcSpec, LineSpec, Placement, Template, TemplateSegment

lengths = st.floats(-500.0, 500.0, allow_nan=False)
placements = st.builds(Placement, x_m=lengths, y_m=lengths, rotation_deg=st.floats(-360.0, 360.0), mirror=st.booleans())
L_SHAPE = Template(
    name="l",
    segments=(
        TemplateSegment(id="line", line=LineSpec(start=(1.0, 0.0), end=(4.0, 2.0))),
        TemplateSegment(id="arc", arc=ArcSpec(start=(2.0, 0.0), center=(0.0, 0.0), sweep_angle=1.2)),
    ),
)


def samples(template: Template) -> np.ndarray:
    return np.concatenate(
        [np.column_stack(s.curve().at(np.linspace(0.0, s.curve().length_m, 5))[:2]) for s in template.segments]
    )


@given(placements)
def test_points_go_where_the_formula_says(placement: Placement) -> None:
    turn = math.radians(placement.rotation_deg)
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    flip = np.diag([1.0, -1.0 if placement.mirror else 1.0])
    expected = samples(L_SHAPE) @ (rotation @ flip).T + [placement.x_m, placement.y_m]
    np.testing.assert_allclose(samples(place(L_SHAPE, placement)), expected, atol=1e-9)


@given(placements)
def test_a_mirrored_sweep_turns_round_and_twice_is_nothing(placement: Placement) -> None:
    mirror = Transform(1.0, 0.0, 0.0, 0.0, mirror=True)
    arc = place(L_SHAPE, placement).segments[1].arc
    assert arc is not None
    assert mirror.arc(arc).sweep_angle == -arc.sweep_angle
    assert mirror.arc(mirror.arc(arc)) == arc


def test_quarter_turns_are_exact() -> None:
    there = place(L_SHAPE, Placement(x_m=10, rotation_deg=90))
    assert there.segments[0].line == LineSpec(start=(10.0, 1.0), end=(8.0, 4.0))
    assert there.source == "Placed: its origin at x 10, y 0 m, turned by 90 degrees."


def test_a_file_is_read_into_the_map_frame() -> None:
    text = L_SHAPE.model_copy(update={"placement": Placement(x_m=5, y_m=-2, mirror=True)}).to_json()
    assert '"placement"' in text
    read = parse_template(text)
    assert read.placement is None
    assert read == place(L_SHAPE, Placement(x_m=5, y_m=-2, mirror=True))
    assert parse_template(read.to_json()) == read  # it is not placed twice


def test_placing_it_off_the_map_is_told() -> None:
    with pytest.raises(SpecError, match=r"beyond 10000 m; place it nearer"):
        placed(load_template("soccer-11"), Placement(x_m=9_990.0))


def test_a_kilometre_is_a_kilometre_on_the_earth() -> None:
    """Against the arc lengths of WGS 84: meridian and parallel at 57° north."""
    a, e2, lat = SEMI_MAJOR_M, FLATTENING * (2 - FLATTENING), math.radians(57.0)
    w = math.sqrt(1 - e2 * math.sin(lat) ** 2)
    step = math.degrees(1000.0 / (a * (1 - e2) / w**3)), math.degrees(1000.0 / (a / w * math.cos(lat)))
    base = Origin(latitude_deg=57.0, longitude_deg=10.0, altitude_m=0.0)
    north = Origin(latitude_deg=57.0 + step[0], longitude_deg=10.0, altitude_m=0.0)
    east = Origin(latitude_deg=57.0, longitude_deg=10.0 + step[1], altitude_m=0.0)
    assert offset_m(north, base) == pytest.approx((0.0, 1000.0), abs=0.01)
    assert offset_m(east, base) == pytest.approx((1000.0, 0.12), abs=0.02)  # a parallel bends north of the tangent
    assert same_place(base, base) and not same_place(base, north)


@given(st.floats(-0.01, 0.01), st.floats(-0.015, 0.015), st.floats(-70.0, 70.0))
@settings(max_examples=100)
def test_a_drawing_keeps_its_place_on_the_earth(dlat: float, dlon: float, latitude: float) -> None:
    """Each point, carried to another map frame, is the same point of the earth: checked by its own small frame."""
    there = Origin(latitude_deg=latitude, longitude_deg=10.0, altitude_m=0.0)
    here = Origin(latitude_deg=latitude + dlat, longitude_deg=10.0 + dlon, altitude_m=0.0)
    drawing = Template(
        name="t", origin=there, segments=(TemplateSegment(id="a", line=LineSpec(start=(0, 0), end=(100.0, 50.0))),)
    )
    moved = to_map(drawing, here)
    assert moved.origin == here
    # The line's end as degrees, by the local radii of curvature about the drawing's origin.
    a, e2 = SEMI_MAJOR_M, FLATTENING * (2 - FLATTENING)
    phi = math.radians(latitude)
    w = math.sqrt(1 - e2 * math.sin(phi) ** 2)
    mid = phi + 25.0 / (a * (1 - e2) / w**3)
    end = Origin(
        latitude_deg=latitude + math.degrees(50.0 / (a * (1 - e2) / w**3)),
        longitude_deg=10.0 + math.degrees(100.0 / (a / math.sqrt(1 - e2 * math.sin(mid) ** 2) * math.cos(mid))),
        altitude_m=0.0,
    )
    line = moved.segments[0].line
    assert line is not None
    assert line.start == pytest.approx(offset_m(there, here), abs=1e-6)
    assert line.end == pytest.approx(offset_m(end, here), abs=4e-3)


def test_without_an_origin_a_drawing_is_in_the_map_frame() -> None:
    assert to_map(L_SHAPE, Origin()) is L_SHAPE
