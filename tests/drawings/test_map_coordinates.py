"""Drawings in map coordinates (UTM), with every option: moved first, then built."""

from pathlib import Path
from typing import Any

import ezdxf
import pytest
import shapely

from touchline.drawings.importer import Anchor, ImportOptions, import_drawing
from touchline.drawings.picture import bounds
from touchline.schemas.errors import SpecError
from touchline.schemas.template import Template

EAST, NORTH = 650_000.25, 6_300_000.5


def site(tmp_path: Path) -> Path:
    document = ezdxf.new("R2010", units=6)
    space = document.modelspace()
    for layer, margin in (("edge", 0.0), ("lawn", 5.0), ("bed", 10.0)):
        x1, y1, x2, y2 = EAST + margin, NORTH + margin, EAST + 40 - margin, NORTH + 30 - margin
        space.add_lwpolyline([(x1, y1), (x2, y1), (x2, y2), (x1, y2)], close=True, dxfattribs={"layer": layer})
    space.add_hatch(dxfattribs={"layer": "bed"}).paths.add_polyline_path(
        [(EAST, NORTH), (EAST + 9, NORTH), (EAST, NORTH + 9)]
    )
    space.add_arc((EAST + 20, NORTH + 15), 3, 0, 180, dxfattribs={"layer": "arc"})
    space.add_spline([(EAST, NORTH), (EAST + 9, NORTH + 3), (EAST + 20, NORTH)], dxfattribs={"layer": "arc"})
    path = tmp_path / "site.dxf"
    document.saveas(path)
    return path


@pytest.mark.parametrize(
    ("options", "low", "high"),
    [
        ({}, (-20, -15), (20, 15)),
        ({"areas": True, "anchor": Anchor.CORNER}, (0, 0), (40, 30)),
        ({"fill": True}, (-20, -15), (20, 15)),
        ({"layers": ("lawn",), "areas": True, "boundary": "edge"}, (-15, -10), (15, 10)),
        ({"layers": ("lawn",), "boundary": "edge", "anchor": Anchor.CORNER}, (0, 0), (30, 20)),
    ],
)
def test_every_option(tmp_path: Path, options: dict[str, Any], low: tuple[int, int], high: tuple[int, int]) -> None:
    template = import_drawing(site(tmp_path), ImportOptions(**options)).template
    found = bounds(template)
    assert found[0] == pytest.approx(low, abs=0.02) and found[1] == pytest.approx(high, abs=0.02)
    assert Template.model_validate_json(template.to_json()).to_json() == template.to_json()
    if options.get("boundary"):
        assert template.boundary is not None
        x1, y1, _, _ = shapely.Polygon(template.boundary.corners).bounds
        assert (x1, y1) == pytest.approx((low[0] - 5, low[1] - 5))


@pytest.mark.parametrize("options", [{"boundary": "edge", "layers": ("lawn",)}, {"areas": True}, {"fill": True}])
def test_the_own_origin_is_too_far_away(tmp_path: Path, options: dict[str, Any]) -> None:
    with pytest.raises(SpecError, match=r"reaches 6,300,0\d\d m from its own origin; .* --anchor centre"):
        import_drawing(site(tmp_path), ImportOptions(anchor=Anchor.OWN, **options))


def test_what_is_not_chosen_may_be_anywhere(tmp_path: Path) -> None:
    path = site(tmp_path)
    document = ezdxf.readfile(path)
    document.modelspace().add_line((0, 0), (1, 1), dxfattribs={"layer": "stray"})
    document.saveas(path)
    assert len(import_drawing(path, ImportOptions(layers=("lawn",))).template.segments) == 4
    with pytest.raises(SpecError, match="from its centre origin"):
        import_drawing(path)


def test_a_boundary_elsewhere_is_refused(tmp_path: Path) -> None:
    document = ezdxf.new("R2010", units=6)
    document.modelspace().add_circle((0, 0), 5)
    document.modelspace().add_circle((EAST, NORTH), 5, dxfattribs={"layer": "edge"})
    document.saveas(tmp_path / "site.dxf")
    with pytest.raises(SpecError, match=r"circle-\w+ reaches .* from the centre origin; check --scale and --boundary"):
        import_drawing(tmp_path / "site.dxf", ImportOptions(boundary="edge"))


def test_an_svg_in_map_coordinates(tmp_path: Path) -> None:
    path = tmp_path / "site.svg"
    head = f'width="40000mm" height="30000mm" viewBox="{EAST} {-NORTH} 40 30"'
    path.write_text(
        f'<svg {head}><g id="edge"><rect x="{EAST + 1}" y="{-NORTH + 1}" width="38" height="28"/></g></svg>'
    )
    options = ImportOptions(areas=True, boundary="edge", layers=("edge",))
    template = import_drawing(path, options).template
    assert bounds(template)[1] == pytest.approx((19, 14))
