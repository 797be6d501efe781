"""Goals from the console: aiming by keys and mouse, preview, sending as one step, and what is shown of the drive."""

import math
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
from textual.pilot import Pilot
from textual.widgets import Input, RadioButton, Static

from tests.tui import scenes
from tests.tui.console import console, last, plain, shown_map, until
from tests.tui.scenes import received
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.template import Template
from touchline.tui.app import ConsoleApp
from touchline.tui.goal_dialog import GoalDialog
from touchline.tui.goal_draft import GoalDraft, PlanAsked, stepped
from touchline.tui.job import PathView
from touchline.tui.key_bar import KeyBar
from touchline.tui.map_view import MapView
from touchline.tui.panels import StatusPanel
from touchline.tui.protocol import CallFailed
from touchline.tui.robot import ShownPose
from touchline.tui.signal_bar import SignalBar
from touchline.tui.viewport import round_step_m

TAKEN = (received(topics.TEMPLATE, m.String()), received(topics.PLAN, scenes.drive_response().trajectory))
"""Messages of the robot about a drive that it has taken."""


def driving(state: int, arc_length_m: float, **fields: float) -> m.TraversalStatus:
    return m.TraversalStatus(state=state, total_length_m=8.0, arc_length_m=arc_length_m, segment_count=1, **fields)


@asynccontextmanager
async def previewed() -> AsyncIterator[tuple[ConsoleApp, scenes.FakeLink, Pilot[None]]]:
    """The robot stands, and its way to a goal is shown."""
    async with console(*scenes.standing(), size=(80, 24)) as (app, link, pilot):
        link.answers[topics.PLAN_SERVICE.name] = scenes.drive_response()
        await pilot.press("d", "enter")
        await until(pilot, lambda: app.state.drive.path is not None)
        yield app, link, pilot


@pytest.mark.parametrize(
    ("value", "steps", "step", "expected"),
    [(0.37, 1, 1.0, 1.0), (0.37, -1, 1.0, 0.0), (0.3, 1, 0.1, 0.4), (-0.3, -1, 0.1, -0.4), (0.37, 0, 1.0, 0.37)],
)
def test_steps_lead_to_round_figures(value, steps, step, expected):
    assert stepped(value, steps, step) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("most_m", "step_m"), [(1.0, 1.0), (0.99, 0.5), (3.7, 2.0), (0.004, 0.002), (100.0, 100.0)])
def test_a_step_is_round_and_no_more_than_a_cell(most_m, step_m):
    assert round_step_m(most_m) == pytest.approx(step_m)


def test_a_free_heading_is_first_turned_to_how_the_goal_lies():
    draft = GoalDraft()
    draft.begin(0.0, 0.0)
    draft.place(0.0, 5.0)
    draft.turn(1, ShownPose(0.0, 0.0, 0.3))
    assert draft.goal is not None
    assert draft.goal.heading_rad == pytest.approx(math.pi / 2)
    draft.turn(-1, None)
    assert draft.goal.heading_rad == pytest.approx(math.radians(85.0))
    draft.free_heading()
    assert math.isnan(draft.goal.heading_rad)


def test_whatever_changes_the_goal_makes_its_plan_void():
    answer = scenes.drive_response()
    for change in (
        lambda draft: draft.move(1, 0, 0.5),
        lambda draft: draft.turn(1, None),
        lambda draft: draft.free_heading(),
        lambda draft: draft.choose(m.PoseGoal(method="cubic")),
    ):
        draft = GoalDraft()
        draft.begin(1.0, 2.0)
        draft.ask(PlanAsked("a"))
        draft.planned(answer.trajectory, answer.report, answer.message)
        change(draft)
        assert (draft.path, draft.message, draft.asked) == (None, "", None)


def test_where_a_path_leads_to():
    """Backward, then a turn on the spot: the robot heads against the path's tangent, and turned."""
    back = scenes.line_segment("a", "transition", (0.0, 0.0), (-3.0, 0.0))
    back = back.model_copy(update={"direction": m.LinearDirection(value=m.LinearDirection.BACKWARD)})
    place = m.Point(x=-3.0, y=0.0)
    turn = m.Arc(start=place, center=place, sweep_angle=math.pi / 3)
    spin = m.Segment(id="b", curve=m.CurveMessage(type=m.CurveType(value=m.CurveType.ARC), arc=(turn,)))
    path = PathView.of(m.Trajectory(path=m.Path(segments=(back, spin))), None)
    assert path.destination is not None
    assert path.destination.x_m == pytest.approx(-3.0)
    assert path.destination.heading_rad == pytest.approx(math.pi / 3)


async def test_aiming_by_keys_with_the_map_and_the_panel_telling_of_it():
    async with console(*scenes.standing(), size=(80, 24)) as (app, link, pilot):
        await pilot.press("d")
        assert all(key in plain(app, KeyBar) for key in ("e E-STOP", "enter Go", "h Any heading", "esc Leave"))
        step_m = round_step_m(app.query_one(MapView).view.cell_m)
        await pilot.press("right", "right", "up", "shift+down")
        goal = app.state.drive.goal
        assert goal is not None
        assert (goal.x_m, goal.y_m) == pytest.approx((1.0 + 2 * step_m, 2.0 + step_m * 0.9))
        assert math.isnan(goal.heading_rad)
        assert "✕" in shown_map(app)
        assert "heading  any" in plain(app, StatusPanel)
        await pilot.press(">", ">", "<")
        assert f"{goal.x_m:.2f}, {goal.y_m:.2f} m" in plain(app, StatusPanel)
        assert "°" in plain(app, StatusPanel)
        assert "✕" not in shown_map(app)
        await pilot.press("h")
        assert "heading  any" in plain(app, StatusPanel)
        await pilot.press("escape")
        assert app.state.drive.goal is None
        assert not link.asked
        view = app.query_one(MapView).view
        await pilot.press("right")
        assert app.query_one(MapView).view.center_x_m > view.center_x_m, "arrows pan again"


async def test_a_goal_that_leaves_the_view_takes_it_along():
    async with console(*scenes.standing(), size=(80, 24)) as (app, _link, pilot):
        await pilot.press("d", *["left"] * 40)
        goal, view = app.state.drive.goal, app.query_one(MapView).view
        assert goal is not None
        assert view.to_cell(goal.x_m, goal.y_m) is not None
        assert view.center_x_m < 0.0


async def test_the_mouse_gives_place_and_heading():
    async with console(*scenes.standing(), size=(80, 24)) as (app, _link, pilot):
        await pilot.press("d")
        field = app.query_one(MapView)
        corner = field.content_region.offset - field.region.offset
        before = field.view
        await pilot.mouse_down(MapView, offset=(corner.x + 20, corner.y + 10))
        await pilot.hover(MapView, offset=(corner.x + 20, corner.y + 4))
        await pilot.mouse_up(MapView, offset=(corner.x + 20, corner.y + 4))
        goal = app.state.drive.goal
        assert goal is not None
        x, y = field.view.to_field(20.5, 10.5)
        assert (goal.x_m, goal.y_m) == pytest.approx((x, y), abs=round_step_m(field.view.cell_m) * 0.06)
        assert goal.heading_rad == pytest.approx(math.pi / 2, abs=0.2)
        assert field.view == before, "the field is not dragged"
        await pilot.mouse_down(MapView, offset=(corner.x + 8, corner.y + 4))
        await pilot.hover(MapView, offset=(corner.x + 9, corner.y + 4))
        await pilot.mouse_up(MapView, offset=(corner.x + 9, corner.y + 4))
        goal = app.state.drive.goal
        assert goal is not None
        assert math.isnan(goal.heading_rad), "so near to the place a heading is not meant"
        await pilot.hover(MapView, offset=(corner.x + 30, corner.y + 4))
        assert math.isnan(goal.heading_rad)


async def test_preview_then_drive_is_enter_twice():
    async with console(*scenes.standing(), size=(80, 24)) as (app, link, pilot):
        link.answers[topics.PLAN_SERVICE.name] = scenes.drive_response()
        await pilot.press("d", "right", "enter")
        await until(pilot, lambda: app.state.drive.path is not None)
        ((_, request),) = link.asked
        assert request.options.start.tolist() == pytest.approx([1.0, 2.0, 0.5])
        assert request.goal[0].x_m == app.state.drive.goal.x_m
        assert math.isnan(request.goal[0].heading_rad)
        assert not request.template_json
        app.tick()
        panel = plain(app, StatusPanel)
        assert "any: → 0°" in panel, "the heading that was chosen"
        assert "8.00 m, 19.50 s; dubins instead of g2" in " ".join(panel.split())
        assert "drive there" in panel
        await pilot.press("enter")
        await until(pilot, lambda: app.state.drive.goal is None)
        assert link.names() == [topics.PLAN_SERVICE.name, topics.GOTO.name]
        sent = link.asked[1][1]
        assert sent.goal == request.goal[0]
        assert not len(sent.options.start), "the robot begins where it is"
        link.incoming += TAKEN
        app.tick()
        assert app.state.loaded.drives


async def test_a_refusal_is_shown_as_it_is_and_the_goal_stays():
    why = "has its goal at its start: give another goal: the robot is there already"
    async with console(*scenes.standing(), size=(80, 24)) as (app, link, pilot):
        link.answers[topics.PLAN_SERVICE.name] = m.PlanResponse(success=False, message=why)
        await pilot.press("d", "enter")
        await until(pilot, lambda: app.state.drive.message)
        app.tick()
        assert " ".join(plain(app, StatusPanel).split()).count(why) == 1
        assert last(app)[1] == f"Preview refused: {why}"
        assert app.state.drive.goal is not None
        await pilot.press("right")
        assert why[:10] not in plain(app, StatusPanel)


@pytest.mark.parametrize(("key", "stop"), [("e", topics.ESTOP), ("a", topics.ABORT), ("space", topics.PAUSE)])
async def test_a_stop_goes_out_while_the_goal_is_on_its_way(key, stop):
    """The robot still plans when the operator thinks better of it; that it then stays is the robot's part."""
    async with previewed() as (app, link, pilot):
        link.held = threading.Event()
        await pilot.press("enter", key)
        if key == "a":
            await pilot.press("y")
        link.held.set()
        await until(pilot, lambda: stop.name in link.names())
        await until(pilot, lambda: app.state.drive.goal is None)
        assert sorted(set(link.names())) == sorted((topics.PLAN_SERVICE.name, topics.GOTO.name, stop.name))


async def test_a_goal_that_is_changed_is_aimed_at_on_whatever_is_answered_about_the_one_before():
    async with previewed() as (app, link, pilot):
        for word in ("Drive", "changed meanwhile"):  # while it is sent, while its way is planned
            link.held = threading.Event()
            await pilot.press("enter", "right")
            link.held.set()
            await until(pilot, lambda word=word: word in last(app)[1])
            assert last(app)[0] == m.Event.INFO
            assert app.state.drive.goal is not None and app.state.drive.path is None


async def test_no_goal_while_the_robot_is_on_a_job_or_there_is_none(template: Template):
    async with console(*scenes.mid_run(template)) as (app, _link, pilot):
        await pilot.press("d")
        assert app.state.drive.goal is None
        assert "on a job" in plain(app, SignalBar)
    async with console(*scenes.up()) as (app, _link, pilot):
        await pilot.press("d")
        assert app.state.drive.goal is None
        assert "no robot" in plain(app, SignalBar)


async def test_a_robot_that_does_not_know_yet_where_it_is_drives_without_a_preview_and_the_console_says_so():
    idle = received(topics.STATUS, m.TraversalStatus(state=m.TraversalStatus.IDLE))
    async with console(*scenes.up(), idle, size=(80, 24)) as (app, link, pilot):
        await pilot.press("d", "right", "enter")
        app.tick()
        panel = " ".join(plain(app, StatusPanel).split())
        assert "no preview: the robot finds its position only when it is to drive" in panel
        assert "drive there unseen" in panel
        assert not link.asked
        await pilot.press("enter")
        await until(pilot, lambda: app.state.drive.goal is None)
        assert link.names() == [topics.GOTO.name]


async def test_a_job_that_began_meanwhile_keeps_the_drive_from_being_sent(template: Template):
    async with previewed() as (app, link, pilot):
        link.incoming.append(received(topics.STATUS, driving(m.TraversalStatus.RUNNING, 1.0)))
        app.tick()
        await pilot.press("enter")
        assert link.names() == [topics.PLAN_SERVICE.name]
        assert "on a job" in plain(app, SignalBar)


async def test_method_law_and_time_are_offered_and_asked_for():
    async with console(*scenes.standing(), size=(80, 24)) as (app, link, pilot):
        link.answers[topics.PLAN_SERVICE.name] = CallFailed("nobody answers")
        await pilot.press("d", "right", "m")
        assert isinstance(app.screen, GoalDialog)
        field = app.screen.query_one("#duration", Input)
        field.value = "-3"
        await pilot.press("enter")
        assert "above 0" in str(app.screen.query_one("#problem", Static).visual)
        link.stops = False  # it need not say so
        await pilot.press("ctrl+e")
        await until(pilot, lambda: link.names() == [topics.ESTOP.name])
        link.asked.clear()
        field.value = "12.5"
        for name in ("dubins", "quintic"):
            next(button for button in app.screen.query(RadioButton) if button.name == name).value = True
        await pilot.pause()
        field.focus()
        await pilot.press("enter")
        await until(pilot, lambda: link.asked)
        goal = link.asked[0][1].goal[0]
        assert (goal.method, goal.law, goal.duration_s) == ("dubins", "quintic", 12.5)
        app.tick()
        assert "dubins, quintic in 12.5 s" in plain(app, StatusPanel)
        await pilot.press("escape", "d")
        begun = app.state.drive.goal
        assert begun is not None
        assert (begun.method, begun.law, begun.duration_s) == ("dubins", "quintic", 0.0), "a time is for one goal"


async def test_the_drive_is_told_until_it_ends_and_by_how_much_it_missed():
    under_way = driving(m.TraversalStatus.RUNNING, 3.0, remaining_s=12.0, speed_mps=0.4)
    async with console(*scenes.standing(), *TAKEN, received(topics.STATUS, under_way)) as (app, link, pilot):
        panel = plain(app, StatusPanel)
        assert "9.00, 2.00 m" in panel
        assert "5.0 m" in panel
        assert "0:12" in panel
        assert "covered" not in panel
        link.incoming += [
            received(topics.ODOMETRY, scenes.odometry(9.03, 2.04, math.radians(1.5))),
            received(topics.STATUS, driving(m.TraversalStatus.DONE, 8.0, elapsed_s=19.0)),
        ]
        app.tick()
        await pilot.pause()
        panel = plain(app, StatusPanel)
        assert "50 mm, 1.5°" in panel
        assert "next goal" in panel


async def test_the_plan_that_is_prepared_stays_while_the_robot_drives(template: Template):
    async with previewed() as (app, link, pilot):
        app.operator.choose(template, template.to_json())
        await pilot.press("enter")
        await until(pilot, lambda: app.state.drive.goal is None)
        assert app.state.template is not None
        link.incoming += TAKEN
        link.incoming.append(received(topics.STATUS, driving(m.TraversalStatus.RUNNING, 1.0)))
        app.tick()
        assert app.state.template is None
        link.incoming.append(received(topics.STATUS, driving(m.TraversalStatus.DONE, 8.0)))
        app.tick()
        assert app.state.template is not None


async def test_an_aborted_job_needs_no_reset_before_a_drive(template: Template):
    aborted = received(topics.STATUS, scenes.status(template, m.TraversalStatus.ABORTED, 14))
    async with console(*scenes.mid_run(template), aborted) as (app, _link, pilot):
        await pilot.press("d")
        panel = plain(app, StatusPanel)
        assert "preview the drive" in panel
        assert "covered" not in panel, "that was the job before"
