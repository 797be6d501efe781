"""The screen of all robots: who is picked, what goes to one or to all, and an emergency stop that is never far."""

from typing import Any

import numpy as np
import pytest
from textual.widgets import Static

from tests.tui.console import plain, until
from tests.tui.fleets import S, asked, fleet, fleet_console
from tests.tui.scenes import received
from tests.with_full import with_full
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.messages import TeamCell, TeamCells
from touchline.tui.desks import REST_S
from touchline.tui.fleet_list import FleetList
from touchline.tui.fleet_map import FleetMap
from touchline.tui.header import HeaderBar
from touchline.tui.key_bar import KeyBar
from touchline.tui.keys import FLEET_TABLE
from touchline.tui.order_registry import Phase
from touchline.tui.panels import LinesPanel, StatusPanel
from touchline.tui.protocol import CallFailed, NodeChanged
from touchline.tui.robots_bar import RobotsBar
from touchline.tui.roll_call import Heard
from touchline.tui.signal_bar import SignalBar


def stopped() -> Any:
    return received(topics.STATUS, m.TraversalStatus(state=S.ESTOPPED))


async def test_all_robots_are_shown_and_the_picked_one_alone_after_enter():
    async with fleet_console(fleet(12, S.RUNNING), "v") as scene:
        shown = scene.text()
        assert "FLEET  12" in shown
        assert "► 12 running" in shown
        assert all(f"▌{name}" in shown or f" {name} " in shown for name in list(scene.links)[:8])
        await scene.pilot.press("down", "down")
        await scene.tick()
        assert "▌r03" in scene.text()
        await scene.pilot.press("enter")
        await scene.tick()
        assert scene.app.fleet_screen is None
        assert plain(scene.app, HeaderBar)
        assert scene.app.query_one(StatusPanel).border_title == "Status of r03"


async def test_one_robot_alone_has_no_fleet_and_says_why():
    async with fleet_console(fleet(1), "v") as scene:
        assert scene.app.fleet_screen is None
        assert "r01 is the only robot" in scene.text()
        await scene.pilot.press("x")
        await scene.tick()
        assert "All: r01 is the only robot" in scene.text()
        assert not {"Fleet", "Other robot"} & set(plain(scene.app, KeyBar).split("  "))
        assert not scene.app.query_one(RobotsBar).display
        assert scene.app.query_one(SignalBar).region.y == 1


async def test_robots_in_trouble_are_on_top_as_the_list_is_opened_and_by_name_after_n():
    async with fleet_console(fleet(50, *[S.RUNNING] * 49, S.ABORTED), "v") as scene:
        lines = [line for line in scene.text().splitlines() if "ABORTED" in line or "▌r01" in line]
        assert "r50" in lines[0]
        await scene.pilot.press("n")
        await scene.tick()
        assert "ABORTED" not in scene.text(), "r50 is far below"
        await scene.pilot.press("end")
        await scene.tick()
        assert "▌r50" in scene.text()
        await scene.pilot.press("home")
        await scene.tick()
        assert "▌r01" in scene.text()


async def test_a_silent_robot_is_on_top_within_a_second():
    async with fleet_console(fleet(20, S.RUNNING), "v") as scene:
        await scene.tick(0.9, silent=("r17",))
        shown = scene.text()
        assert "▲ 1 silent" in shown
        first = shown.splitlines()[next(n for n, line in enumerate(shown.splitlines()) if " robot " in line) + 1]
        assert "r17" in first
        assert "SILENT" in first
        assert "was RUNNING" in first


async def test_keys_and_clicks_are_for_one_robot():
    async with fleet_console(fleet(3, S.RUNNING), "v", "question_mark") as scene:
        listed = str(scene.app.screen.query("#dialog Static").last(Static).visual)
        for key in FLEET_TABLE:
            assert not key.bars or f" {key.shown} " in listed, key
        await scene.pilot.press("question_mark", "down", "space")
        await until(scene.pilot, lambda: asked(scene.links["r02"]))
        assert asked(scene.links["r02"]) == [topics.PAUSE.name]
        assert not asked(scene.links["r01"])
        await until(scene.pilot, lambda: "r02: Pause: done" in scene.text())
        await scene.pilot.press("t")
        await scene.tick()
        assert scene.app.screen is scene.screen, "jobs are not prepared where no single map is"
        assert "enter shows it alone" in scene.text()
        assert "batt ≥ 88 % r03" in str(scene.screen.query_one("#totals", LinesPanel).visual)
        await scene.pilot.click(FleetList, offset=(3, 3))
        await scene.tick()
        assert scene.app.robots.selected_name == "r03"
        at = scene.screen.query_one(FleetMap).view.to_cell(12.0, 0.0)
        assert at is not None
        await scene.pilot.click(FleetMap, offset=(at[0], at[1] + 1))
        await scene.tick()
        assert scene.app.robots.selected_name == "r02"
        await scene.pilot.click(FleetList, offset=(3, 2))
        await scene.tick()
        assert scene.app.fleet_screen is None, "a click on the picked one shows it"


@pytest.mark.parametrize("keys", [(), ("v",)], ids=["one robot", "fleet"])
async def test_an_order_to_all_asks_first_says_how_many_and_then_who_answered_what(keys: tuple[str, ...]):
    links = fleet(6, S.RUNNING)
    links["r02"].answers[topics.PAUSE.name] = m.CommandResponse(success=False, message="a person is in the way")
    links["r03"].answers[topics.PAUSE.name] = CallFailed("no answer within 1.0 s")
    async with fleet_console(links, *keys, "x") as scene:
        assert "An order to all 6 robots" in scene.text()
        await scene.pilot.press("space")
        assert "Pause 6 of 6 robots?" in scene.text()
        assert not any(asked(link) for link in links.values())
        await scene.pilot.press("y")
        await until(scene.pilot, lambda: all(asked(link) for link in links.values()))
        assert all(asked(link) == [topics.PAUSE.name] for link in links.values())
        for name, link in links.items():
            if name not in ("r02", "r03"):
                link.incoming.append(received(topics.STATUS, m.TraversalStatus(state=S.PAUSED)))
        await scene.tick()

        def answered() -> bool:
            return sum(each.heard is Heard.WAITING for each in scene.app.robots.answers().values()) == 0

        await until(scene.pilot, answered)
        await scene.tick()
        shown = scene.text()
        assert "Pause to 6:   4 ✓ acknowledged   1 ✗ refused   1 ▲ silent" in shown
        assert "Pause refused: a person is in the way: r02" in shown
        await scene.pilot.press("escape")
        await scene.tick()
        assert "Pause to 6" not in scene.text()
        assert scene.app.fleet_screen is not None, "escape has put the answers away first"


async def test_a_resume_of_all_goes_to_those_that_are_paused_once_it_is_confirmed():
    async with fleet_console(fleet(4, S.PAUSED, S.RUNNING), "v", "x", "g") as scene:
        assert "Resume 2 of 4 robots?" in scene.text()
        await scene.pilot.press("n")
        await scene.tick()
        assert scene.app.screen is scene.screen
        assert not any(asked(link) for link in scene.links.values())
        await scene.pilot.press("x", "r")
        await scene.tick()
        assert "Reset: there are no robots for it" in scene.text()
        assert scene.app.screen is scene.screen
        await scene.pilot.press("x", "g", "y")
        await until(scene.pilot, lambda: asked(scene.links["r03"]))
        assert [bool(asked(link)) for link in scene.links.values()] == [True, False, True, False]


@pytest.mark.parametrize(
    "keys",
    [
        ("v", "ctrl+e"),
        ("x", "e"),
        ("v", "x", "space", "e"),
        ("v", "m", "m", "e"),
    ],
    ids=" ".join,
)
async def test_the_emergency_stop_of_all_works_from_every_screen_of_the_fleet(keys: tuple[str, ...]):
    links = fleet(6, S.RUNNING)
    async with fleet_console(links, *keys) as scene:
        await until(scene.pilot, lambda: all(asked(link) for link in links.values()))
        assert all(asked(link) == [topics.ESTOP.name] for link in links.values())

        def held() -> bool:
            scene.app.tick()
            return all(scene.state(name).orders.stop.phase is Phase.HELD for name in links)

        await until(scene.pilot, held)


async def test_each_robot_s_answer_to_an_emergency_stop_is_shown():
    links = fleet(12, S.RUNNING)
    links["r09"].stops = False
    links["r11"].stops = False
    links["r11"].answers[topics.ESTOP.name] = CallFailed("nobody answers")
    async with fleet_console(links, "v", "e") as scene:
        await until(scene.pilot, lambda: all(asked(link) for link in links.values()))
        await scene.tick()
        await scene.tick(1.2, silent=())
        await until(scene.pilot, lambda: scene.state("r09").orders.stop.answer)
        await scene.tick()
        shown = scene.text()
        assert "Emergency stop to 12:   10 ✓ acknowledged   1 ✗ refused   1 ▲ silent" in shown
        assert "no answer: r11" in shown
        assert "answered, but says RUNNING: repeated: r09" in shown
        rows = [line for line in shown.splitlines() if line.startswith((" r09", " r11"))]
        assert all("E-STOP" in row for row in rows)
        for name in ("r09", "r11"):
            links[name].incoming.append(stopped())
        await scene.tick()
        assert "Emergency stop to 12:   12 ✓ acknowledged" in scene.text()


def closely(scene: Any) -> list[bool]:
    return [link.closely for link in scene.links.values()]


async def test_only_the_robot_in_view_is_listened_to_closely_once_the_operator_rests_on_it():
    async with fleet_console(fleet(4, S.IDLE)) as scene:
        assert closely(scene) == [True, False, False, False]
        await scene.pilot.press("o")
        await scene.tick()
        assert not any(closely(scene)), "keys that are held down pass many by"
        await scene.tick(2.0 * REST_S + 0.2)
        assert closely(scene) == [False, True, False, False]
        assert scene.links["r02"].fetches == 1
        await scene.pilot.press("d")
        await scene.tick()
        await scene.pilot.press("o")
        await scene.tick(2.0 * REST_S + 0.2)
        assert closely(scene) == [False, True, True, False], "r02 still has a goal to set"


@pytest.mark.parametrize(("count", "size"), with_full((256, (10, 3)), full=[(50, (200, 60))]))
async def test_hundreds_of_robots_fit_any_terminal_whatever_is_pressed(count: int, size: tuple[int, int]):
    async with fleet_console(fleet(count), "v", size=size) as scene:
        for key in ("down", "pagedown", "end", "m", "plus", "f", "0", "m", "n", "up", "m", "minus"):
            await scene.pilot.press(key)
        await scene.tick(0.4)
        lines = scene.text().splitlines()
        assert (len(lines), {len(line) for line in lines}) == (size[1], {size[0]})
        assert "FLEET" in lines[0] or size[0] < 12
        await scene.pilot.press("e")
        await until(scene.pilot, lambda: all(asked(link) for link in scene.links.values()))


async def test_a_terminal_that_shrinks_keeps_robots_answers_and_stop_in_sight():
    async with fleet_console(fleet(12, S.RUNNING), "v", "e") as scene:
        await until(scene.pilot, lambda: all(asked(link) for link in scene.links.values()))
        await scene.pilot.resize_terminal(20, 6)
        await scene.tick()
        await scene.tick()
        lines = scene.text().splitlines()
        assert lines[2].startswith(" Emergency stop")
        assert "r01" in lines[3]
        assert lines[5].startswith(" e E-STOP")


async def test_the_cells_of_a_team_are_drawn_as_long_as_its_coordinator_tells_them():
    square = np.array([(-2.0, -2.0), (6.0, -2.0), (6.0, 6.0), (-2.0, 6.0)])
    cell = TeamCell(name="r01", x_m=square[:, 0], y_m=square[:, 1], goal_x_m=5.0, goal_y_m=4.0)
    async with fleet_console(fleet(3), "v") as scene:
        assert not scene.app.robots.layer.cells
        scene.known.team_says.append(TeamCells(cells=(cell,)))
        await scene.tick()
        assert np.array_equal(scene.app.robots.layer.cells["r01"], square)
        assert scene.app.robots.layer.goals == {"r01": (5.0, 4.0)}
        await scene.tick(2.0)
        assert scene.app.robots.layer.cells
        await scene.tick(2.0)
        assert not scene.app.robots.layer.cells


def claimed(*places: tuple[float, float]) -> Any:
    """The leader of a shared job tells of a robot."""
    poses = [m.PoseStamped(pose=m.Pose(position=m.Point(x=x, y=y))) for x, y in places]
    return received(topics.CLAIMED, m.NavPath(poses=tuple(poses)), "operator")


@pytest.mark.parametrize(
    "end",
    [claimed(), NodeChanged(topics.OPERATOR, False), NodeChanged(topics.ROBOT_SIM, False)],
    ids=["nothing is claimed", "the leader has gone", "the robot has gone"],
)
async def test_the_stretch_that_a_robot_claims_is_drawn_until(end: Any):
    async with fleet_console(fleet(3), "v") as scene:

        def claims() -> dict[str, Any]:
            return {name: line.tolist() for name, line in scene.app.robots.layer.claims.items()}

        for name, y_m in (("r01", 5.0), ("r02", 8.0)):
            scene.links[name].incoming += [NodeChanged(topics.OPERATOR, True), claimed((0.0, y_m), (20.0, y_m))]
        await scene.tick()
        both = {"r01": [[0.0, 5.0], [20.0, 5.0]], "r02": [[0.0, 8.0], [20.0, 8.0]]}
        assert claims() == both
        layer = scene.app.robots.layer
        await scene.tick(5.0, silent=())
        assert scene.app.robots.layer is layer, "nothing is drawn anew as long as nothing else is told"
        scene.links["r01"].incoming += [NodeChanged(topics.OPERATOR, False), NodeChanged(topics.OPERATOR, True)]
        await scene.tick()
        assert claims() == both, "another operator has come and gone"
        scene.links["r01"].incoming.append(end)
        await scene.tick()
        await scene.tick()
        assert claims() == {"r02": both["r02"]}
