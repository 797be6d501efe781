"""Areas in the console: on the map, in the list of lines, in the dialog, and in the pictures of a job."""

import math
from pathlib import Path

import numpy as np
import pytest
from textual.widgets import Input, Static

from tests.tui.console import console
from touchline.drawings.picture import picture
from touchline.jobs.single.painted_picture import draw_painted
from touchline.schemas.messages import PaintMarks, PlanOptions
from touchline.schemas.template import Area, LineSpec, Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import CLAY_ROLLER
from touchline.services.planner.plan import plan
from touchline.tui.dialogs import Choice, PlanDialog
from touchline.tui.job import PathView, TemplateView

BOX = ((0.0, 0.0), (2.0, 0.0), (2.0, 0.36), (0.0, 0.36))
HOLE = ((0.5, 0.1), (1.0, 0.1), (1.0, 0.3), (0.5, 0.3))


def lawn() -> Template:
    line = TemplateSegment(id="edge", line=LineSpec(start=(0.0, 2.0), end=(3.0, 2.0)))
    return Template(name="lawn", segments=(line,), areas=(Area(id="lawn", outline=BOX, holes=(HOLE,), angle_deg=0.0),))


def test_an_area_is_drawn_by_its_edges_and_listed_by_its_swaths_once_they_are_planned() -> None:
    view = TemplateView.of(lawn(), "{}")
    assert [row.segment_id for row in view.rows] == ["edge", "lawn"]
    assert math.isnan(view.rows[1].length_m)
    assert set(view.lines) == {"edge", "lawn"}
    assert (np.nanmin(view.lines["lawn"].x_m), np.nanmax(view.lines["lawn"].y_m)) == pytest.approx((0.0, 0.36))
    path = PathView.of(plan(lawn(), Vehicle(), PlanOptions(order="given")).trajectory, view)
    swaths = [row for row in path.rows if row.segment_id != "edge"]
    assert [row.segment_id for row in swaths] == [f"lawn#{k}" for k in range(1, len(swaths) + 1)]
    assert all(0.4 < row.length_m <= 2.0 + 1e-9 for row in swaths)
    assert sum(not way for way in path.transition) == 1 + len(swaths)


@pytest.mark.parametrize(
    ("before", "vehicle", "areas", "offered"),
    [
        (PlanOptions(laps=2), CLAY_ROLLER, False, []),
        (PlanOptions(laps=2), CLAY_ROLLER, True, ["lap-and-lanes", "zigzag", "parallel"]),
        (PlanOptions(area_method="zigzag"), Vehicle(), True, ["parallel"]),
    ],
    ids=["no areas", "areas", "a method for other tools"],
)
async def test_how_to_cover_areas_is_asked_where_there_are_any(
    before: PlanOptions, vehicle: Vehicle, areas: bool, offered: list[str]
) -> None:
    chosen: list[PlanOptions | None] = []
    async with console(size=(80, 24)) as (app, _, pilot):
        app.push_screen(PlanDialog(before, vehicle, areas=areas), chosen.append)
        await pilot.pause()
        names = [button.name for button in app.screen.query("#area-method Choice").results(Choice)]
        assert names == offered
        await pilot.press("enter")
        await pilot.pause()
    assert chosen == [PlanOptions(method="g2", area_method=offered[0] if areas else "", laps=before.laps)]


async def test_a_roller_is_asked_how_to_cover() -> None:
    chosen: list[PlanOptions | None] = []
    async with console(size=(80, 24)) as (app, _, pilot):
        app.push_screen(PlanDialog(PlanOptions(margin_m=0.1), CLAY_ROLLER, areas=True), chosen.append)
        await pilot.pause()
        assert app.screen.query_one("#dialog").max_scroll_y == 0, "all of it is seen"
        fields = {name: app.screen.query_one(f"#{name}", Input) for name in PlanDialog.AREA_FIELDS}
        assert [field.value for field in fields.values()] == ["", "0.1", "", "", ""]
        fields["laps"].value = "1.5"
        await pilot.press("enter")
        await pilot.pause()
        assert chosen == [] and "whole number" in str(app.screen.query_one("#problem", Static).visual)
        fields["laps"].value, fields["swath_angle_deg"].value, fields["coverage_pct"].value = "2", "-30", "99.9"
        fields["margin_m"].value = ""
        await pilot.press("enter")
        await pilot.pause()
    (options,) = chosen
    assert options is not None and options.swath_angle_deg.tolist() == [-30.0]
    assert (options.laps, options.coverage_pct, options.margin_m, options.overlap_m) == (2, 99.9, 0.05, 0.03)


def test_pictures_show_areas(tmp_path: Path) -> None:
    drawn = picture(lawn())
    assert 'fill-rule="evenodd"' in drawn
    assert drawn.count("Z") == 2  # the outline and the hole
    assert "evenodd" not in picture(lawn().model_copy(update={"areas": ()}))
    x = np.linspace(0.0, 2.0, 5)
    strokes = [
        PaintMarks(segment_id=name, width_m=0.12, x_m=x, y_m=np.full(5, y))
        for name, y in (("lawn#1", 0.06), ("edge", 2.0), ("grass#1", 1.0))
    ]
    draw_painted(lawn(), strokes, tmp_path / "painted.svg")
    without = tmp_path / "without.svg"
    draw_painted(lawn(), strokes[1:], without)
    drawing, bare = ((tmp_path / name).read_text(encoding="utf-8") for name in ("painted.svg", "without.svg"))
    assert drawing.count("#ffffff") == bare.count("#ffffff") + 1
