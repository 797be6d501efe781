"""Goals from the console while the robot drives: what their way begins with, how it is kept up, and what ends it."""

import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from textual.pilot import Pilot

from tests.tui import scenes
from tests.tui.console import console, last, plain, until
from tests.tui.scenes import FakeLink
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.path_start import KEEP_S, PathStart
from touchline.tui.app import ConsoleApp
from touchline.tui.goal_orders import DRAWN_S, REFRESH_S
from touchline.tui.key_bar import KeyBar
from touchline.tui.panels import StatusPanel
from touchline.tui.protocol import CallFailed, NodeChanged
from touchline.tui.signal_bar import SignalBar

PLAN, GOTO = topics.PLAN_SERVICE.name, topics.GOTO.name
RUNNING, PAUSED, ESTOPPED = m.TraversalStatus.RUNNING, m.TraversalStatus.PAUSED, m.TraversalStatus.ESTOPPED


@asynccontextmanager
async def previewed() -> AsyncIterator[tuple[ConsoleApp, FakeLink, Pilot[None]]]:
    """The robot drives to one goal, and the way to another one is shown."""
    async with console(*scenes.standing(), *scenes.on_the_drive(), size=(80, 24)) as (app, link, pilot):
        link.answers[PLAN] = scenes.leaving_response()
        await pilot.press("d", "up", "enter")
        await until(pilot, lambda: app.state.drive.path is not None)
        app.tick()
        yield app, link, pilot


def later(app: ConsoleApp, link: FakeLink, seconds: float, state: int = RUNNING, **fields: Any) -> None:
    """So much later, of which the robot tells."""
    link.incoming += scenes.on_the_drive(state, **fields)
    app.state.now_s += seconds
    app.state.nodes[topics.ROBOT_SIM].heard(app.state.now_s)
    app.tick()


def panel_of(app: ConsoleApp) -> str:
    return " ".join(plain(app, StatusPanel).split())


def test_a_driving_robot_leaves_its_drive_and_a_standing_one_begins_at_its_pose():
    drive, goal = scenes.drive_response().trajectory, m.PoseGoal(x_m=2.0)
    for state in (m.TraversalStatus.IDLE, m.TraversalStatus.DONE, m.TraversalStatus.ABORTED):
        asked = PathStart(state, (1.0, 2.0, 0.5), drive, 3.0, 1.0).request(goal, m.PlanOptions(), "{}", "a")
        assert asked.options.start.tolist() == [1.0, 2.0, 0.5]
        assert not asked.leaving
    for pace, keep_s in ((0.5, KEEP_S), (4.0, 4.0 * KEEP_S)):
        asked = PathStart(RUNNING, (1.0, 2.0, 0.5), drive, 3.0, pace).request(goal, m.PlanOptions(), "{}", "a")
        (leaving,) = asked.leaving
        assert (leaving.arc_length_m, leaving.keep_s) == (3.0, keep_s), "what planning takes passes on the wall clock"
        assert leaving.trajectory == drive
        assert not len(asked.options.start)


async def test_the_way_from_a_driving_robot_leaves_its_drive_and_is_told_to_move_on():
    async with previewed() as (app, link, pilot):
        ((_, request),) = link.asked
        (leaving,) = request.leaving
        assert leaving.trajectory == scenes.drive_response().trajectory
        assert leaving.arc_length_m == 3.0
        assert not len(request.options.start)
        panel = panel_of(app)
        assert "moves on with the robot, planned anew when sent" in panel
        assert "drive on there" in panel
        assert "now to 9.00, 2.00 m" in panel, "where it drives meanwhile"
        assert "space Pause" in plain(app, KeyBar)
        await pilot.press("enter")
        await until(pilot, lambda: app.state.drive.goal is None)
        assert link.names() == [PLAN, GOTO]
        assert link.asked[1][1].goal == request.goal[0]


async def test_what_is_shown_is_planned_anew_every_second_without_a_word():
    async with previewed() as (app, link, pilot):
        said, first = len(app.state.log.entries), app.state.drive.path
        later(app, link, 0.9 * REFRESH_S, arc_length_m=3.3)
        assert link.names() == [PLAN]
        later(app, link, 0.2 * REFRESH_S, arc_length_m=3.4)
        await until(pilot, lambda: app.state.drive.path is not first)
        assert link.asked[1][1].leaving[0].arc_length_m == 3.4
        assert link.asked[1][1].goal == link.asked[0][1].goal
        assert len(app.state.log.entries) == said
        later(app, link, 1.1 * REFRESH_S, m.TraversalStatus.DONE, arc_length_m=8.0)
        await until(pilot, lambda: not app.state.drive.shown.under_way)
        assert link.asked[2][1].options.start.tolist() == pytest.approx([9.0, 2.0, 0.0]), "it has come to rest"
        later(app, link, 5 * REFRESH_S, m.TraversalStatus.DONE, arc_length_m=8.0)
        assert link.names() == [PLAN] * 3


async def test_a_way_that_cannot_be_planned_anew_grows_old_visibly_and_is_then_drawn_no_more():
    async with previewed() as (app, link, pilot):
        link.answers[PLAN] = m.PlanResponse(success=False, message="has no path to come")
        later(app, link, 1.1 * REFRESH_S)
        await until(pilot, lambda: app.state.drive.trouble)
        later(app, link, 2.0)
        assert "preview of 3 s ago: has no path to come" in panel_of(app)
        assert app.state.drive.path is not None
        later(app, link, DRAWN_S)
        panel = panel_of(app)
        assert app.state.drive.path is None
        assert "has no path to come" in panel
        assert "preview the drive" in panel
        asked = len(link.asked)
        link.answers[PLAN] = scenes.leaving_response()
        later(app, link, 5.0)
        await pilot.pause()
        assert len(link.asked) == asked, "a way that comes back by itself could be sent unseen"


async def test_a_planner_that_is_gone_is_told_beside_the_preview():
    async with previewed() as (app, link, pilot):
        link.answers[PLAN] = CallFailed("nobody answers")
        link.incoming.append(NodeChanged(topics.PLANNER, False))
        later(app, link, 1.1 * REFRESH_S)
        assert "the planner is down" in panel_of(app)
        await until(pilot, lambda: app.state.drive.trouble)
        await pilot.press("enter")
        await until(pilot, lambda: GOTO in link.names())


@pytest.mark.parametrize(
    ("state", "says"),
    [(PAUSED, "paused; resume or abort it first (g, a)"), (ESTOPPED, "emergency-stopped; reset it first (r)")],
)
async def test_a_robot_that_is_stopped_meanwhile_ends_the_preview_and_the_remedy_is_named(state, says):
    async with previewed() as (app, link, pilot):
        later(app, link, 0.1, state)
        assert app.state.drive.path is None
        assert app.state.drive.goal is not None
        assert says in panel_of(app)
        await pilot.press("enter")
        assert f"Preview: the robot is {says}" in plain(app, SignalBar)
        await pilot.press("escape", "d")
        assert app.state.drive.goal is None
        assert f"Drive: the robot is {says}" in plain(app, SignalBar)
        assert link.names() == [PLAN]


async def test_what_a_driving_robot_refuses_is_told_and_the_goal_stays():
    why = "the trajectory leaves the boundary by 0.52 m"
    async with previewed() as (app, link, pilot):
        link.answers[GOTO] = m.GotoResponse(success=False, message=why)
        await pilot.press("enter")
        await until(pilot, lambda: why in plain(app, SignalBar))
        later(app, link, 3 * REFRESH_S)
        assert why in panel_of(app), "it is not written over by another preview"
        assert link.names() == [PLAN, GOTO]


async def test_another_goal_goes_out_while_one_is_still_on_its_way_and_the_newest_is_told_of():
    async with previewed() as (app, link, pilot):
        first = threading.Event()

        def goto(request: Any) -> m.GotoResponse:
            if len([name for name in link.names() if name == GOTO]) == 1:
                first.wait(60)
                return m.GotoResponse(success=False, message="another goal has come since")
            return m.GotoResponse(success=True, message="to the goal: 5.24 m")

        link.answers[GOTO] = goto
        await pilot.press("enter", "up", "enter")
        await until(pilot, lambda: app.state.drive.path is not None)
        await pilot.press("enter")
        await until(pilot, lambda: app.state.drive.goal is None)
        first.set()
        await until(pilot, lambda: "another goal has come since" in last(app)[1])
        assert "Drive: to the goal: 5.24 m" in plain(app, SignalBar)
        assert link.names() == [PLAN, GOTO, PLAN, GOTO]


async def test_a_goal_that_is_on_its_way_says_so_and_for_how_long():
    async with previewed() as (app, link, pilot):
        link.held = threading.Event()
        await pilot.press("enter")
        assert "Drive sent" in plain(app, SignalBar)
        later(app, link, 3.2)
        assert "Drive sent, no answer for 3 s" in plain(app, SignalBar)
        await pilot.press("escape")
        assert "the goal has been sent" in plain(app, SignalBar)
        link.held.set()
        await until(pilot, lambda: last(app)[1].startswith("Drive: done"))


async def test_a_way_from_rest_is_not_sent_to_a_robot_that_has_set_off_since():
    async with console(*scenes.standing()) as (app, link, pilot):
        link.answers[PLAN] = scenes.drive_response()
        await pilot.press("d", "up", "enter")
        await until(pilot, lambda: app.state.drive.path is not None)
        link.held = threading.Event()
        later(app, link, 0.1)
        await pilot.press("enter")
        assert GOTO not in link.names()
        assert "has set off meanwhile" in plain(app, SignalBar)
        link.held.set()
        later(app, link, 1.1 * REFRESH_S)
        await until(pilot, lambda: app.state.drive.shown.under_way)
        await pilot.press("enter")
        await until(pilot, lambda: GOTO in link.names())
