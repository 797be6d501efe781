"""The console's view of a machine that covers areas: on the map and in the panels."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.robot_sim.rolled import WIDTH_M
from tests.tui import pan, scenes
from tests.tui.console import reduced, settle
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.curves import Curve
from touchline.schemas.vehicles.shipped import CLAY_ROLLER
from touchline.tui.area_dots import AreaScene
from touchline.tui.area_layer import AreaLayer
from touchline.tui.job import sample
from touchline.tui.panels import status_lines
from touchline.tui.raster import Polyline
from touchline.tui.viewport import Viewport

VIEW = Viewport(60, 20).fitted((0.0, 0.0, pan.LENGTH_M, pan.BREADTH_M))


def way(lanes: float) -> Polyline:
    (marks,) = pan.rolled(lanes)
    return Polyline.of([(marks.x_m, marks.y_m)])


def scene(lanes: float, at: int | None, **changes: Any) -> AreaScene:
    areas = pan.template().areas
    plan = tuple(sample([Curve.from_message(segment.curve)]) for segment in pan.plan().path.segments)
    return AreaScene(areas, way(lanes), 1, WIDTH_M, plan, 1, at, **changes)


def dots_m2(bits: np.ndarray) -> float:
    return float(np.bitwise_count(bits).sum()) * VIEW.dot_m * VIEW.dot_height_m


def test_the_band_is_as_wide_as_the_tool_and_what_it_leaves_out_is_told_once_it_has_passed() -> None:
    covered, missed = AreaLayer().update(VIEW, scene(2.0, 4))
    assert dots_m2(covered) == pytest.approx(35.0 * 2.0 * WIDTH_M + 2.0 * WIDTH_M, rel=0.15)
    before = dots_m2(missed)
    _, missed = AreaLayer().update(VIEW, scene(4.0, 8))
    strip_m2 = 35.0 * 1.0
    assert dots_m2(missed) - before == pytest.approx(0.0, abs=25.0)
    assert strip_m2 * 0.5 < dots_m2(missed) < strip_m2 + 60.0
    _, all_of_it = AreaLayer().update(VIEW, scene(4.0, None))
    assert dots_m2(all_of_it) == pytest.approx(791.0 - 35.0 * 4 * WIDTH_M, rel=0.12)


def test_a_way_that_grows_is_drawn_as_it_would_be_at_once() -> None:
    layer, areas = AreaLayer(), pan.template().areas
    whole = way(3.5)
    for end in range(1, len(whole) + 37, 37):
        part = Polyline(whole.x_m[:end], whole.y_m[:end], whole.joined[:end])
        grown = layer.update(VIEW, AreaScene(areas, part, 1, WIDTH_M))
    at_once = AreaLayer().update(VIEW, AreaScene(areas, whole, 1, WIDTH_M))
    assert all((a == b).all() for a, b in zip(grown, at_once, strict=True))
    cleared, _ = layer.update(VIEW, AreaScene(areas, way(0.1), 2, WIDTH_M))
    assert dots_m2(cleared) == pytest.approx(3.5 * WIDTH_M, rel=0.5)


@pytest.mark.parametrize(
    ("speed_mps", "yaw_rate_radps", "shown"),
    [(1.0, -0.1, "◂ 11.3° left"), (-0.5, -0.05, "▸ 11.3° right"), (0.8, 0.0, "straight ahead"), (0.01, 0.1, None)],
)
def test_how_the_rear_wheel_is_steered(speed_mps: float, yaw_rate_radps: float, shown: str | None) -> None:
    app = pan.app_with([])
    app.state.vehicle = CLAY_ROLLER
    twist = m.Twist(linear=m.Vector3(x=speed_mps), angular=m.Vector3(z=yaw_rate_radps))
    moving = scenes.odometry(0.0, 0.0, 0.0).model_copy(update={"twist": m.TwistWithCovariance(twist=twist)})
    reduced([*pan.rolling(2.0), scenes.received(topics.ODOMETRY, moving)], app.state)
    lines = [line.plain for line in status_lines(app.state, 40)]
    assert [line for line in lines if line.startswith("steering")] == ([f"steering {shown}"] if shown else [])


def test_areas_of_a_tool_that_paints_are_shown_as_before() -> None:
    app = pan.app_with(pan.rolling(2.0))
    assert not pan.app_with([]).state.covers
    reduced(pan.rolling(2.0), app.state)
    assert app.state.covers
    app.state.vehicle = type(app.state.vehicle)()
    assert not app.state.covers


@pytest.mark.parametrize("size", [(80, 24), (120, 40)])
def test_rolling_looks_like_this(snap_compare: Callable[..., bool], size: tuple[int, int]) -> None:
    assert snap_compare(pan.app_with(pan.rolling(4.4)), terminal_size=size, run_before=settle)


def test_a_finished_pan_looks_like_this(snap_compare: Callable[..., bool]) -> None:
    events = pan.finished()
    assert snap_compare(pan.app_with(events), terminal_size=(120, 40), run_before=settle)
