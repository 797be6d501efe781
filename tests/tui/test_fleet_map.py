"""The map of all robots: everybody is on it or said not to be, however little room there is."""

from collections import Counter

import numpy as np
import pytest

from tests.tui import scenes
from tests.tui.console import reduced
from tests.tui.fleets import S, robot
from tests.tui.scenes import received
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.scenario import Origin, Scenario
from touchline.schemas.setup import Setup
from touchline.tui.fleet_layer import FleetLayer, outline
from touchline.tui.fleet_raster import FleetRaster, fleet_scene, nearest
from touchline.tui.map_raster import ARROWS, Cells, Ink
from touchline.tui.node_health import LIVE_S
from touchline.tui.protocol import NodeChanged
from touchline.tui.raster import BRAILLE_BASE
from touchline.tui.reduction import apply_event
from touchline.tui.robots import Robots
from touchline.tui.viewport import Viewport

SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])


def some(count: int) -> Robots:
    robots = Robots()
    for number in range(count):
        reduced(robot(number, S.RUNNING).poll(), robots.add(f"r{number + 1:02}"), now_s=0.0)
    return robots


def composed(robots: Robots, columns: int = 80, rows: int = 12) -> tuple[Cells, Viewport]:
    scene = fleet_scene(robots)
    box = scene.bounds()
    assert box is not None
    view = Viewport(columns, rows).fitted(box, 0.12)
    return FleetRaster().compose(view, scene), view


def text(cells: Cells) -> str:
    return "\n".join("".join(chr(code) for code in row) for row in cells.codes)


@pytest.mark.parametrize("size", [(80, 10), (40, 5), (20, 3), (5, 2), (200, 50)])
def test_every_robot_has_its_mark_or_is_one_of_a_crowd_that_is_counted(size: tuple[int, int]):
    robots = some(50)
    cells, view = composed(robots, *size)
    poses = {name: state.robot.pose for name, state in robots.states.items()}
    places = {name: view.to_cell(pose.x_m, pose.y_m) for name, pose in poses.items() if pose}
    crowds = Counter(places.values())
    assert sum(crowds.values()) == 50
    for name, place in places.items():
        assert place is not None
        column, row = place
        mark = chr(cells.codes[row, column])
        selected = place == places["r01"]
        assert mark in ARROWS if crowds[place] == 1 or selected else mark == str(crowds[place]), name


def test_names_never_cover_robots_or_other_names():
    robots = some(50)
    cells, view = composed(robots)
    shown = text(cells)
    for name, state in robots.states.items():
        pose = state.robot.pose
        assert pose is not None
        column, row = view.to_cell(pose.x_m, pose.y_m) or (0, 0)
        assert chr(cells.codes[row, column]) in ARROWS
        assert shown.count(name) <= 1
    assert shown.count("r") > 25, "there is room for most"
    assert "r01" in shown, "the one in view is named first"


def test_a_silent_robot_is_a_question_mark_and_a_dead_one_a_cross_where_it_was():
    robots = some(3)
    robots.states["r02"].now_s = 2 * LIVE_S
    apply_event(robots.states["r03"], NodeChanged(topics.ROBOT_SIM, False), 0.0)
    cells, view = composed(robots)
    for x_m, mark, ink in ((12.0, "?", Ink.UNHEARD), (24.0, "✗", Ink.GONE)):
        column, row = view.to_cell(x_m, 0.0) or (0, 0)
        assert (chr(cells.codes[row, column]), cells.inks[row, column]) == (mark, ink)


def test_robots_of_another_origin_are_not_on_the_map_and_said_not_to_be():
    robots = some(3)
    for name, latitude_deg in (("r01", 50.0), ("r02", 51.0)):
        setup = Setup(scenario=Scenario(origin=Origin(latitude_deg=latitude_deg)))
        apply_event(robots.states[name], received(topics.SETUP, m.String(data=setup.model_dump_json())), 0.0)
    scene = fleet_scene(robots)
    assert scene.elsewhere == ("r02",)
    assert [each.name for each in scene.robots] == ["r01", "r03"], "one that has not told is taken to be here"


def test_cells_goals_and_claims_are_drawn_and_those_of_the_selected_robot_set_off():
    robots = some(2)
    claims = {"r01": np.array([[-8.0, 40.0], [40.0, 40.0]]), "r02": np.array([[-8.0, 30.0], [40.0, 30.0]])}
    cells_m = {"r01": SQUARE - 5.0, "r02": SQUARE + np.array([7.0, -5.0])}
    robots.layer = FleetLayer(cells_m, {"r01": (3.0, 3.0), "r02": (15.0, 3.0)}, claims)
    drawn, view = composed(robots, 80, 20)

    def ink(x_m: float, y_m: float) -> int:
        column, row = view.to_cell(x_m, y_m) or (0, 0)
        return int(drawn.inks[row, column])

    assert ink(-5.0, 0.0) == Ink.CURRENT
    assert ink(17.0, -3.0) == Ink.LIMIT
    assert ink(3.0, 3.0) == Ink.GOAL
    assert ink(15.0, 3.0) == Ink.LABEL

    def along(claim: np.ndarray) -> Counter[int]:
        """In which inks it is drawn."""
        return Counter(ink(x_m, claim[0, 1]) for x_m in np.linspace(claim[0, 0], claim[1, 0], 200))

    own, other = along(claims["r01"]), along(claims["r02"])
    assert own[Ink.CURRENT] > 50 and not own[Ink.CURRENT_PATH]
    assert other[Ink.CURRENT_PATH] > 50 and not other[Ink.CURRENT]
    row = drawn.codes[drawn.inks == Ink.CURRENT_PATH]
    assert len(set(row.tolist())) > 1, "dashed"
    robots.select("r02")
    drawn, view = composed(robots, 80, 20)
    assert along(claims["r02"])[Ink.CURRENT] > 50 and along(claims["r01"])[Ink.CURRENT_PATH] > 50
    assert ink(17.0, -3.0) == Ink.CURRENT


def test_polygons_that_are_none_are_left_out():
    broken = [np.zeros((0, 2)), np.zeros((2, 2)), np.full((3, 2), np.nan), np.zeros(3)]
    assert len(outline(broken)) == 0
    assert len(outline([*broken, SQUARE])) == 5
    claims = {str(number): points for number, points in enumerate([*broken, SQUARE[:1]])}
    assert len(FleetLayer(claims=claims).claimed()) == 2, "only the one of two points is a line"
    layer = FleetLayer({"r1": SQUARE}, {"r1": (np.nan, 0.0)})
    robots = some(1)
    robots.layer = layer
    assert fleet_scene(robots).bounds() is not None


def test_the_robot_nearest_to_the_pointer_is_picked_and_none_from_afar():
    robots = some(3)
    scene, (_, view) = fleet_scene(robots), composed(robots)
    column, row = view.to_cell(12.0, 0.0) or (0, 0)
    assert nearest(view, scene, column + 0.5, row + 0.5) == "r02"
    assert nearest(view, scene, 0.0, 0.0) is None


def test_close_up_bodies_are_drawn_to_scale():
    robots = some(2)
    scene = fleet_scene(robots)
    far = FleetRaster().compose(Viewport(60, 20, dot_m=0.5), scene)
    near = FleetRaster().compose(Viewport(60, 20, dot_m=0.05), scene)
    assert not (far.inks == Ink.BODY).any()
    assert (near.inks == Ink.BODY).any()
    assert (near.codes >= BRAILLE_BASE).any()


def test_the_robot_in_view_says_who_else_is_where_it_is():
    robots = some(2)
    apply_event(robots.states["r02"], received(topics.ODOMETRY, scenes.odometry(0.1, 0.0, 0.0)), 0.0)
    cells, _ = composed(robots, 80, 12)
    scene = fleet_scene(robots)
    far = FleetRaster().compose(Viewport(40, 5, dot_m=1.0), scene)
    assert "r01 +1" in text(far)
    assert "+1" not in text(cells), "close up they are apart"
