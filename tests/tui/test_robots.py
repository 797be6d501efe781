"""Several robots: all are shown, orders go to the one in view, and an emergency stop goes to every one."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from textual.pilot import Pilot

from tests.tui import scenes
from tests.tui.console import plain, shown_map, until
from tests.tui.fleets import asked
from tests.tui.scenes import FakeLink, FakeLinks, received
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles import Vehicle
from touchline.tui.app import ConsoleApp
from touchline.tui.header import HeaderBar
from touchline.tui.key_bar import KeyBar
from touchline.tui.panels import StatusPanel
from touchline.tui.protocol import CallFailed, NodeChanged
from touchline.tui.reduction import apply_event
from touchline.tui.robots import Robots
from touchline.tui.robots_bar import RobotsBar, robots_line
from touchline.tui.signal_bar import SignalBar

NAMES = ("r1", "club/r2", "r3")


def robot(x_m: float, state: int = m.TraversalStatus.RUNNING) -> FakeLink:
    """A robot that drives there."""
    link = FakeLink()
    link.incoming += [NodeChanged(name, True) for name in topics.SERVING]
    line = {"painted_ids": ("a",), "painted_fraction": (0.4,)}
    status = m.TraversalStatus(state=state, segment_count=1, coverage_pct=40.0, **line)
    where = scenes.odometry(x_m, 0.0, 0.0)
    link.incoming += [received(topics.ODOMETRY, where), received(topics.STATUS, status)]
    return link


@asynccontextmanager
async def three(**more: FakeLink) -> AsyncIterator[tuple[ConsoleApp, dict[str, FakeLink], Pilot[None], FakeLinks]]:
    links = FakeLinks({**more, **{name: robot(12.0 * number - 15.0) for number, name in enumerate(NAMES)}})
    app = ConsoleApp(links, clock=lambda: 1.0)
    async with app.run_test(size=(120, 40)) as pilot:
        app.tick()
        await pilot.pause()
        yield app, links.links, pilot, links


async def test_all_robots_are_on_the_map_and_in_their_row_by_name():
    async with three() as (app, _, _, _):
        field_map = shown_map(app)
        assert all(name in field_map for name in NAMES)
        row = plain(app, RobotsBar)
        assert row.index("r1 ") < row.index("club/r2 ") < row.index("r3 ")
        assert row.count("RUNNING 40 %") == 3
        assert "Other robot" in plain(app, KeyBar)


async def test_a_robot_that_a_coordinator_guides_has_no_lines_and_covers_nothing():
    guided = robot(0.0)
    guided.incoming.append(received(topics.STATUS, m.TraversalStatus(state=m.TraversalStatus.RUNNING, elapsed_s=25.0)))
    async with three(a1=guided) as (app, _, _, _):
        assert "a1  ► RUNNING  " in plain(app, RobotsBar)
        shown = plain(app, StatusPanel)
        assert "guided   by the team's coordinator" in shown and "0:25" in shown
        assert "covered" not in shown and "line" not in shown


async def test_orders_go_to_the_robot_in_view_and_to_no_other():
    async with three() as (app, links, pilot, _):
        await pilot.press("o", "space")
        await until(pilot, lambda: asked(links["club/r2"]))
        assert app.robots.selected_name == "club/r2"
        for link in links.values():
            link.incoming.append(received(topics.STATUS, m.TraversalStatus(state=m.TraversalStatus.ESTOPPED)))
        app.tick()
        await pilot.press("r")
        await until(pilot, lambda: len(asked(links["club/r2"])) == 2)
        assert asked(links["club/r2"]) == [topics.PAUSE.name, topics.RESET.name]
        await pilot.press("o", "o")
        assert app.robots.selected_name == "r1", "it goes round"
        assert not asked(links["r1"])
        assert not asked(links["r3"])
        await pilot.click(RobotsBar, offset=(plain(app, RobotsBar).index("r3"), 0))
        assert app.robots.selected_name == "r3"


async def test_a_question_is_about_the_robot_that_was_in_view_when_it_was_asked():
    async with three() as (app, links, pilot, _):
        await pilot.press("a")
        assert "Abort the job of r1?" in plain_dialog(app)
        app.action_next_robot()
        await pilot.press("y")
        await until(pilot, lambda: asked(links["r1"]))
        assert asked(links["r1"]) == [topics.ABORT.name]
        assert not asked(links["club/r2"])


def plain_dialog(app: ConsoleApp) -> str:
    return " ".join(str(widget.visual) for widget in app.screen.query(".title"))  # type: ignore[attr-defined]


async def test_an_emergency_stop_goes_to_every_robot_and_each_ones_word_is_shown():
    async with three() as (app, links, pilot, _):
        links["r3"].stops = False
        links["r3"].answers[topics.ESTOP.name] = CallFailed("nobody answers")
        await pilot.press("o", "e")
        await until(pilot, lambda: all(topics.ESTOP.name in asked(link) for link in links.values()))

        def acknowledged() -> bool:
            app.tick()
            return plain(app, RobotsBar).count("E-STOPPED") == 2

        await until(pilot, acknowledged)
        row = plain(app, RobotsBar)
        assert "r3  E-STOP SENT" in row or "r3  E-STOP NOT ACKNOWLEDGED" in row
        assert "r3: E-STOP" in plain(app, SignalBar), "told in the row of the orders, too, though r2 is in view"
        await pilot.press("question_mark")
        app.tick()
        await pilot.pause()
        assert "r3: E-STOP" in str(app.screen.query_one(SignalBar).visual), "and on dialogs"
        await pilot.press("escape", "q")
        assert app.is_running, "only this console repeats it"
        await pilot.press("escape")
        links["r3"].incoming.append(received(topics.STATUS, m.TraversalStatus(state=m.TraversalStatus.ESTOPPED)))

        def all_stopped() -> bool:
            app.tick()
            return plain(app, RobotsBar).count("E-STOPPED") == 3

        await until(pilot, all_stopped)
        assert "r3" not in plain(app, SignalBar)


async def test_a_robot_that_turns_up_while_the_others_are_being_stopped_is_stopped_too():
    async with three() as (app, links, pilot, known):
        links["r1"].stops = False
        await pilot.press("e")
        known.links["r4"] = robot(9.0)
        app.tick()
        await until(pilot, lambda: asked(known.links["r4"]))
        assert asked(known.links["r4"]) == [topics.ESTOP.name]
        assert "r4" in plain(app, RobotsBar)


async def test_a_robot_that_was_only_guessed_gives_way_to_those_that_are_there():
    links = FakeLinks({"tt2": FakeLink()})
    app = ConsoleApp(links, clock=lambda: 1.0)
    async with app.run_test(size=(120, 40)) as pilot:
        app.tick()
        assert app.robots.selected_name == "tt2"
        links.links["r1"] = robot(0.0)
        app.tick()
        await pilot.pause()
        assert list(app.robots.states) == ["r1"]
        assert not app.query_one(RobotsBar).display
        assert "○ robot" not in plain(app, HeaderBar)


async def test_each_robot_is_planned_for_as_the_vehicle_that_it_says_it_is():
    async with three() as (app, links, pilot, _):
        wide = Setup(vehicle=Vehicle(name="wide", track_width_m=0.6))
        links["r3"].incoming += [
            received(topics.SETUP, m.String(data=wide.model_dump_json())),
            received(topics.STATUS, m.TraversalStatus(state=m.TraversalStatus.IDLE)),
        ]
        app.tick()
        await pilot.press("o", "o")
        app.operator.choose(scenes.pitch(), scenes.pitch().to_json())
        app.operator.plan(app.operator.options)
        await until(pilot, lambda: links["r3"].asked)
        ((name, request),) = links["r3"].asked
        assert name == topics.PLAN_SERVICE.name
        assert Vehicle.model_validate_json(request.vehicle_json) == wide.vehicle


def test_where_there_is_no_room_for_all_stops_not_acknowledged_are_shown_first():
    robots = Robots()
    for number in range(40):
        robots.add(f"r{number:02}")
    stopped = robots.states["r33"]
    stopped.orders.stop.press("id", "")
    line = robots_line(robots, 80)
    names = [name for name, _ in line]
    assert {"r00", "r33"} <= set(names)
    assert names[-1] == ""
    assert str(line[-1][1]) == f" +{40 - len(names) + 1}"
    assert sum(content.cell_length for _, content in line) <= 80


def test_a_stop_is_for_the_robot_in_view_even_if_it_is_gone_and_for_all_that_are_there():
    robots = Robots()
    for name in NAMES:
        robots.add(name)
    apply_event(robots.states["r3"], NodeChanged(topics.ROBOT_SIM, True), 0.0)
    assert robots.to_stop() == ("r1", "r3")
    robots.remove("r1")
    assert robots.selected_name == "club/r2"
    assert robots.to_stop() == ("club/r2", "r3")
