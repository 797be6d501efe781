"""DXF as it is plotted: what is invisible, off, frozen or not plotted is not painted, whatever block it is in."""

import math
from pathlib import Path
from typing import Any

import ezdxf
import pytest

from touchline.drawings.importer import Anchor, Imported, ImportOptions, import_drawing

OWN = ImportOptions(anchor=Anchor.OWN, detail_m=0.0)


def plotted(tmp_path: Path, draw: Any, **options: Any) -> Imported:
    document = ezdxf.new("R2010", units=6)
    for name in ("off", "frozen", "no plot", "on"):
        document.layers.add(name)
    document.layers.get("off").off()
    document.layers.get("frozen").freeze()
    document.layers.get("no plot").dxf.plot = 0
    document.modelspace().add_line((0, 0), (10, 0))
    draw(document)
    path = tmp_path / "plan.dxf"
    document.saveas(path)
    return import_drawing(path, ImportOptions(anchor=Anchor.OWN, detail_m=0.0, **options))


def line(place: Any, **attributes: Any) -> None:
    place.add_line((0, 5), (7, 5), dxfattribs=attributes)


def in_block(insert: dict[str, Any], **attributes: Any) -> Any:
    def draw(document: Any) -> None:
        line(document.blocks.new("inner"), **attributes)
        document.blocks.new("outer").add_blockref("inner", (0, 0))
        document.modelspace().add_blockref("outer", (0, 0), dxfattribs=insert)

    return draw


@pytest.mark.parametrize(
    "draw",
    [
        lambda document: line(document.modelspace(), layer="off"),
        lambda document: line(document.modelspace(), layer="frozen"),
        lambda document: line(document.modelspace(), layer="No Plot"),
        lambda document: line(document.modelspace(), layer="Defpoints"),
        lambda document: line(document.modelspace(), invisible=1),
        lambda document: line(document.layout("Layout1")),
        in_block({}, invisible=1),
        in_block({"invisible": 1}),
        in_block({}, layer="off"),
        in_block({}, layer="no plot"),
        in_block({"layer": "off"}),  # the line is in layer 0, and so takes the insert's on
        in_block({"layer": "no plot"}),
        in_block({"layer": "frozen"}, layer="on"),  # a frozen insert hides all of it
    ],
)
def test_what_is_not_plotted_is_not_painted(tmp_path: Path, draw: Any) -> None:
    imported = plotted(tmp_path, draw)
    assert [segment.curve().length_m for segment in imported.template.segments] == [10.0]
    assert imported.omissions == ()


@pytest.mark.parametrize("draw", [in_block({"layer": "off"}, layer="on"), in_block({"layer": "on"})])
def test_what_is_plotted_of_a_block_is_painted(tmp_path: Path, draw: Any) -> None:
    assert len(plotted(tmp_path, draw).template.segments) == 2
    assert len(plotted(tmp_path, draw, layers=("on",)).template.segments) == 1


@pytest.mark.parametrize(
    ("draw", "reason"),
    [
        (lambda d: d.modelspace().add_text("GO"), "is TEXT"),
        (lambda d: d.modelspace().add_circle((0, 0), 0), "has a radius of 0 m"),
        (lambda d: d.modelspace().add_spline().set_open_uniform([(0, 0), (1, 1)], degree=3), "is no usable spline"),
        (lambda d: d.modelspace().add_line((0, 0), (math.inf, 0)), "is not finite"),
        (lambda d: d.modelspace().add_blockref("nothing", (0, 0)), "which is not there"),
        (lambda d: d.modelspace().add_3dface([(0, 0), (1, 0), (1, 1)]), "is 3DFACE"),
    ],
)
def test_what_cannot_be_painted_is_left_out_by_name(tmp_path: Path, draw: Any, reason: str) -> None:
    imported = plotted(tmp_path, draw)
    assert len(imported.template.segments) == 1
    (omission,) = imported.omissions
    assert reason in omission.reason and "-" in omission.name


def test_solids_are_painted(tmp_path: Path) -> None:
    draw = lambda document: document.modelspace().add_solid([(0, 5), (4, 5), (0, 8), (4, 8)])  # noqa: E731
    assert plotted(tmp_path, draw, areas=True).template.area_m2 == pytest.approx(12.0)


def test_a_drawing_on_paper_is_named(tmp_path: Path) -> None:
    document = ezdxf.new("R2010", units=6)
    line(document.layout("Layout1"))
    document.saveas(tmp_path / "plan.dxf")
    with pytest.raises(Exception, match="Layout1 is a layout on paper; draw in model space"):
        import_drawing(tmp_path / "plan.dxf")


def test_a_damaged_file_is_painted_as_far_as_it_can_be_read(tmp_path: Path) -> None:
    document = ezdxf.new("R2010", units=6)
    line(document.modelspace())
    path = tmp_path / "plan.dxf"
    document.saveas(path)
    path.write_text(path.read_text().replace("  0\nENDSEC\n  0\nSECTION\n  2\nOBJECTS", "  0\nSECTION\n  2\nOBJECTS"))
    imported = import_drawing(path, OWN)
    assert len(imported.template.segments) == 1
    assert "is damaged" in imported.omissions[0].reason
