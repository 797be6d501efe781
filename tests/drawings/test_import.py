"""SVG and DXF files as templates: exact where the source is, told in one line where they cannot be painted."""

import itertools
import math
from pathlib import Path

import ezdxf
import numpy as np
import pytest

from touchline.drawings.deviation import distance_m
from touchline.drawings.importer import Anchor, ImportOptions, import_drawing
from touchline.drawings.picture import bounds, picture
from touchline.schemas.errors import SpecError
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan

OWN = ImportOptions(anchor=Anchor.OWN, detail_m=0.0)
METRES = ImportOptions(scale_m=1.0, anchor=Anchor.OWN, detail_m=0.0)


PAGE = 'width="40000mm" height="40000mm" viewBox="-10 -10 40 40"'


def svg(tmp_path: Path, body: str, head: str = PAGE) -> Path:
    """A drawing whose lines are black unless they say otherwise."""
    path = tmp_path / "logo.svg"
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {head} stroke="black">{body}</svg>')
    return path


def curves_of(path: Path, options: ImportOptions = OWN) -> list:
    return [segment.curve() for segment in import_drawing(path, options).template.segments]


def test_svg_shapes_are_exact(tmp_path: Path) -> None:
    body = '<rect x="1" y="2" width="3" height="4"/><circle cx="10" cy="5" r="2"/><line x1="0" y1="0" x2="5" y2="1"/>'
    imported = import_drawing(svg(tmp_path, body), METRES)
    by_name: dict[str, list] = {}
    for segment in imported.template.segments:
        by_name.setdefault(segment.label, []).append(segment.curve())
    assert sum(c.length_m for c in by_name["rect-1"]) == pytest.approx(14.0, rel=1e-6)
    assert [1 / abs(c.curvature_1pm) for c in by_name["circle-1"]] == pytest.approx([2.0] * 4, rel=1e-6)
    assert sum(c.length_m for c in by_name["circle-1"]) == pytest.approx(4 * math.pi, rel=1e-6)
    (line,) = by_name["line-1"]
    assert (line.x_m, line.y_m, *line.end[:2]) == pytest.approx((0, 0, 5, -1), abs=1e-5)  # y is turned up
    assert imported.deviation_m < 1e-9


def test_svg_units_give_the_scale(tmp_path: Path) -> None:
    line = '<path d="M0 1H100"/>'
    for head, length in (
        ('width="20000mm" height="10000mm" viewBox="0 0 200 100"', 10.0),
        ('width="50cm" viewBox="0 0 100 100"', 0.5),
        ('height="2in" viewBox="0 0 100 20"', 100 * 0.0254 / 10),
        ('width="100mm" height="100mm"', 100 * 0.0254 / 96),
        ('width="400q"', 100 * 0.0254 / 96),
        ('width="100%" height="20cm" viewBox="0 0 100 200"', 0.1),
    ):
        assert curves_of(svg(tmp_path, line, head))[0].length_m == pytest.approx(length, rel=1e-5), head
    scaled = ImportOptions(scale_m=0.5, anchor=Anchor.OWN)
    for head in ("", 'width="300"', 'width="300px" viewBox="0 0 300 30"', 'width="20mm" viewBox="0 0 200 10"'):
        assert curves_of(svg(tmp_path, line, head), scaled)[0].length_m == pytest.approx(50.0, rel=1e-5)
        if "mm" not in head:
            with pytest.raises(SpecError, match=r"logo\.svg: svg has no width .* --scale"):
                import_drawing(svg(tmp_path, line, head))


def test_svg_curves_arcs_and_sub_paths(tmp_path: Path) -> None:
    body = '<path id="s" d="M0 0 C4 0 4 4 8 4 S12 8 16 8 M0 9 A3 2 30 0 1 4 9 Q6 5 8 9 z"/>'
    imported = import_drawing(svg(tmp_path, body), METRES)
    assert {s.label for s in imported.template.segments} == {"s", "s-part-2"}
    smooth = [s.curve() for s in imported.template.segments if s.label == "s"]
    turns = [math.remainder(a.end[2] - b.heading_rad, 2 * math.pi) for a, b in itertools.pairwise(smooth)]
    assert max(map(abs, turns)) < 1e-6  # the source is smooth there, and so is the fit
    assert imported.deviation_m <= 1e-3
    t = np.linspace(0, 1, 300)[:, None]
    first = 3 * t * (1 - t) ** 2 * [4, 0] + 3 * t**2 * (1 - t) * [4, -4] + t**3 * [8, -4]
    assert distance_m(first, smooth).max() < 1.02e-3


@pytest.mark.parametrize(
    ("body", "says"),
    [
        ('<line x1="0" y1="0" x2="0.001" y2="0"/>', "has nothing to paint"),
        ('<line x1="0" y1="0" x2="1e6" y2="0"/>', "check --scale"),
        ('<line x1="0" y1="0" x2="1e9" y2="0"/>', "line-1 is further out than 100,000 km; check --scale"),
        ('<text id="motto">GO</text>', r"has nothing to paint; motto \(line 1\) is a text; convert it to paths"),
        ("<g>", "is not a readable SVG"),
    ],
)
def test_an_svg_of_which_nothing_can_be_painted_is_refused(tmp_path: Path, body: str, says: str) -> None:
    with pytest.raises(SpecError, match=says) as told:
        import_drawing(svg(tmp_path, body, ""), METRES)
    assert "logo.svg" in str(told.value)


def test_another_kind_of_xml_is_told(tmp_path: Path) -> None:
    path = tmp_path / "page.svg"
    path.write_text("<html><body/></html>")
    with pytest.raises(SpecError, match="has no svg element at its root"):
        import_drawing(path, METRES)


def test_coloured_shapes_are_filled_on_request(tmp_path: Path) -> None:
    ring = '<path id="ring" fill="red" stroke="none" d="M0 0H4V4H0z M1 1H3V3H1z"/>'
    body = f'{ring}<path id="edge" fill="none" stroke="red" d="M6 0H9"/>'
    path = svg(tmp_path, body)
    outline = import_drawing(path, METRES).template
    assert outline.length_m == pytest.approx(16 + 8 + 3, rel=1e-5)
    filled = import_drawing(path, ImportOptions(scale_m=1.0, fill=True)).template
    strokes = [s for s in filled.segments if "fill" in s.id]
    assert {s.label for s in filled.segments} == {"ring, area", "edge"}
    assert sum(s.curve().length_m for s in strokes) * filled.line_width_m == pytest.approx(12.0, rel=0.05)


def test_the_anchor_is_the_origin(tmp_path: Path) -> None:
    path = svg(tmp_path, '<rect x="2" y="1" width="4" height="2"/>')
    for anchor, low in ((Anchor.CENTRE, (-2, -1)), (Anchor.CORNER, (0, 0)), (Anchor.OWN, (2, -3))):
        template = import_drawing(path, ImportOptions(scale_m=1.0, anchor=anchor)).template
        assert bounds(template)[0] == pytest.approx(low, abs=1e-4)


def dxf(tmp_path: Path, units: int = 6) -> tuple:
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = units
    return document, document.modelspace(), tmp_path / "plan.dxf"


def test_dxf_entities(tmp_path: Path) -> None:
    document, space, path = dxf(tmp_path)
    space.add_line((0, 0), (3, 4))
    space.add_arc((10, 0), 2, 90, 0)
    space.add_circle((20, 0), 3)
    space.add_lwpolyline([(0, 10, 1), (4, 10, 0), (4, 14, 0)], format="xyb")
    space.add_ellipse((30, 0), (5, 0), 0.4, 0, math.pi)
    spline = space.add_spline([(0, 20), (3, 24), (8, 19), (12, 22)])
    space.add_point((40, 0))
    document.saveas(path)
    imported = import_drawing(path, OWN)
    by_kind: dict[str, list] = {}
    for segment in imported.template.segments:
        by_kind.setdefault(segment.label.split("-")[0], []).append(segment.curve())
    assert by_kind["line"][0].length_m == pytest.approx(5.0)
    assert by_kind["arc"][0].curvature_1pm * by_kind["arc"][0].length_m == pytest.approx(1.5 * math.pi)
    assert by_kind["circle"][0].length_m == pytest.approx(6 * math.pi)
    assert [c.length_m for c in by_kind["lwpolyline"]] == pytest.approx([2 * math.pi, 4.0])
    assert by_kind["point"][0].length_m == pytest.approx(0.24)
    assert imported.deviation_m <= 1e-3
    t = np.linspace(0, math.pi, 300)
    assert distance_m(np.column_stack((30 + 5 * np.cos(t), 2 * np.sin(t))), by_kind["ellipse"]).max() < 1e-3
    tool = spline.construction_tool()
    drawn = np.array([(p.x, p.y) for p in tool.points(np.linspace(0, tool.max_t, 400))])
    assert distance_m(drawn, by_kind["spline"]).max() < 1e-3
    turns = [
        math.remainder(a.end[2] - b.heading_rad, 2 * math.pi)
        for a, b in zip(by_kind["spline"], by_kind["spline"][1:], strict=False)
    ]
    assert max(map(abs, turns)) < 1e-6


def test_dxf_rational_and_unclamped_splines(tmp_path: Path) -> None:
    document, space, path = dxf(tmp_path)
    # A quarter circle as a rational spline, and a smooth closed curve as an unclamped one.
    space.add_rational_spline([(5, 0), (5, 5), (0, 5)], [1, math.sqrt(0.5), 1], degree=2)
    control = [(3 * math.cos(a), 10 + 3 * math.sin(a)) for a in np.linspace(0, 2 * math.pi, 7)[:-1]]
    space.add_open_spline([*control, *control[:3]], degree=3).dxf.flags = 8
    spline = space[-1]
    spline.knots = list(range(13))
    document.saveas(path)
    by_name: dict[str, list] = {}
    for segment in import_drawing(path, OWN).template.segments:
        by_name.setdefault(segment.label, []).append(segment.curve())
    quarter, loop = by_name.values()
    assert sum(c.length_m for c in quarter) == pytest.approx(2.5 * math.pi, abs=1e-3)
    assert distance_m(np.array([[5 * math.cos(0.7), 5 * math.sin(0.7)]]), quarter)[0] < 1e-3
    assert loop[-1].end[:2] == pytest.approx((loop[0].x_m, loop[0].y_m), abs=1e-9)
    assert math.remainder(loop[-1].end[2] - loop[0].heading_rad, 2 * math.pi) == pytest.approx(0.0, abs=1e-6)


def test_dxf_blocks_layers_and_mirrored_entities(tmp_path: Path) -> None:
    document, space, path = dxf(tmp_path)
    block = document.blocks.new("goal")
    block.add_line((0, 0), (1, 0))
    block.add_circle((0, 0), 1)
    for x in (0, 10):
        space.add_blockref("goal", (x, 5), dxfattribs={"rotation": 90, "xscale": 2, "yscale": 2})
    space.add_arc((-3, 1), 2, 0, 90, dxfattribs={"extrusion": (0, 0, -1)})  # seen from below: about (3, 1)
    document.layers.add("hidden").off()
    space.add_line((0, 0), (99, 0), dxfattribs={"layer": "hidden"})
    document.saveas(path)
    template = import_drawing(path, OWN).template
    lines = [s.curve() for s in template.segments if s.line is not None and s.curve().length_m > 1]
    assert sorted((c.x_m, c.y_m, *map(float, np.round(c.end[:2], 9))) for c in lines)[:2] == [
        pytest.approx((0, 5, 0, 7)),
        pytest.approx((10, 5, 10, 7)),
    ]
    assert sum(s.curve().length_m for s in template.segments if "circle" in s.id) == pytest.approx(2 * 4 * math.pi)
    below = [s.curve() for s in template.segments if s.id.startswith("arc")]
    t = np.linspace(0, math.pi / 2, 50)
    assert distance_m(np.column_stack((3 - 2 * np.cos(t), 1 + 2 * np.sin(t))), below).max() < 1e-3
    assert len({s.id for s in template.segments}) == len(template.segments)


def test_dxf_meshes_are_left_out_by_name(tmp_path: Path) -> None:
    document, space, path = dxf(tmp_path)
    space.add_line((0, 0), (5, 0))
    space.add_polymesh((3, 3))
    document.saveas(path)
    imported = import_drawing(path, OWN)
    assert len(imported.template.segments) == 1
    (omission,) = imported.omissions
    assert omission.name.startswith("polyline-") and "explode it" in omission.reason


def test_dxf_blocks_without_a_height(tmp_path: Path) -> None:
    document, space, path = dxf(tmp_path)
    document.blocks.new("post").add_line((0, 0), (1, 0))
    flat = {"zscale": 0, "xscale": 2}
    row = {**flat, "column_count": 3, "column_spacing": 4}
    document.blocks.new("goal").add_blockref("post", (0, 0), dxfattribs=row)
    space.add_blockref("goal", (1, 1), dxfattribs=flat)
    document.saveas(path)
    lines = sorted((c.x_m, c.y_m, c.length_m) for c in curves_of(path))
    assert lines == [pytest.approx((1 + 8 * i, 1, 4)) for i in range(3)]


def test_dxf_units(tmp_path: Path) -> None:
    for units, metres in ((6, 1.0), (4, 0.001), (2, 0.3048), (1, 0.0254)):
        document, space, path = dxf(tmp_path, units)
        space.add_line((0, 0), (100, 0))
        document.saveas(path)
        assert curves_of(path)[0].length_m == pytest.approx(100 * metres)
    document, space, path = dxf(tmp_path, 0)
    space.add_line((0, 0), (100, 0))
    document.saveas(path)
    with pytest.raises(SpecError, match=r"plan\.dxf: \$INSUNITS states no unit; give .* --scale"):
        import_drawing(path)
    assert curves_of(path, METRES)[0].length_m == pytest.approx(100.0)


def test_dxf_that_cannot_be_painted_is_told(tmp_path: Path) -> None:
    document, space, path = dxf(tmp_path)
    text = space.add_text("GO")
    hatch = space.add_hatch()
    hatch.paths.add_polyline_path([(0, 0), (2, 0), (2, 2), (0, 2)], is_closed=True)
    document.saveas(path)
    with pytest.raises(SpecError, match="has nothing to paint"):
        import_drawing(path)
    filled = import_drawing(path, ImportOptions(fill=True))
    assert filled.template.length_m * 0.12 == pytest.approx(4.0, rel=0.05)
    assert [omission.name for omission in filled.omissions] == [f"text-{text.dxf.handle}"]
    path.write_text("no drawing")
    with pytest.raises(SpecError, match="is not a readable DXF"):
        import_drawing(path)


def test_the_smallest_arcs_that_can_be_imported_can_be_planned(tmp_path: Path) -> None:
    template = import_drawing(svg(tmp_path, '<circle cx="4" cy="2" r="0.05"/>'), METRES).template
    assert all(abs(segment.curve().curvature_1pm) == pytest.approx(20.0) for segment in template.segments)
    plan(template, Vehicle())


def test_circles_tighter_than_an_arc_may_be_become_lines(tmp_path: Path) -> None:
    """The smallest are within half a shortest line of where they begin, and so not there at all."""
    radii = (0.0024, 0.0026, 0.005, 0.007, 0.0099)
    body = "".join(f'<circle cx="{i}" cy="0" r="{r}"/>' for i, r in enumerate(radii))
    imported = import_drawing(svg(tmp_path, body), METRES)
    assert imported.skipped == ("circle-1",)
    assert all(segment.line for segment in imported.template.segments)
    assert imported.deviation_m <= 5e-3


@pytest.mark.parametrize(
    ("name", "options", "says"),
    [
        ("a.png", ImportOptions(), r"give a file that ends in \.svg or \.dxf"),
        ("none.svg", ImportOptions(), "is not a file"),
        ("a.svg", ImportOptions(scale_m=-1.0), "--scale is -1"),
    ],
)
def test_bad_requests_are_told(tmp_path: Path, name: str, options: ImportOptions, says: str) -> None:
    if not name.startswith("none"):
        (tmp_path / name).write_text("<svg/>")
    with pytest.raises(SpecError, match=says):
        import_drawing(tmp_path / name, options)


def test_a_picture_of_a_picture_is_the_same(tmp_path: Path) -> None:
    """The lines of the picture, read back, lie where those of the template do."""
    source = import_drawing(svg(tmp_path, '<ellipse cx="5" cy="5" rx="5" ry="4"/><path d="M0 0H9"/>')).template
    path = tmp_path / "picture.svg"
    path.write_text(picture(source))
    low, high = bounds(source)
    scale = 1.0 / (900.0 / ((1 + 2 * 0.04) * float(max(high - low)) + 2 * 0.12))
    options = ImportOptions(scale_m=scale)
    again = [s.curve() for s in import_drawing(path, options).template.segments if "rect" not in s.id]
    assert sum(c.length_m for c in again) == pytest.approx(source.length_m, rel=1e-3)
