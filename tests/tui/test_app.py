"""Every key and command of the console, driven through a fake link: what is asked, and what is shown of the answer."""

import threading
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from textual.command import CommandList
from textual.events import MouseMove, MouseScrollDown, MouseScrollUp
from textual.pilot import Pilot
from textual.widgets import Input, OptionList, Static

from schemas import messages as m
from schemas import topics
from schemas.template import Template
from tests.tui import scenes
from tests.tui.scenes import FakeLink, received
from tui.app import ConsoleApp
from tui.autostart import AutoStart
from tui.dialogs import ConfirmDialog, KeysDialog, PlanDialog, TemplateDialog
from tui.event_log import ERROR, INFO
from tui.header import HeaderBar
from tui.key_bar import KeyBar
from tui.log_view import LogView
from tui.map_view import MapView
from tui.panels import ServicesPanel, StatusPanel
from tui.protocol import CallFailed, Incoming, NodeChanged
from tui.segments import SegmentsTable


@pytest.fixture(scope="module")
def template() -> Template:
    return scenes.pitch()


@asynccontextmanager
async def console(
    *events: Incoming,
    size: tuple[int, int] = (120, 40),
    autostart: AutoStart | None = None,
    link: FakeLink | None = None,
) -> AsyncIterator[tuple[ConsoleApp, FakeLink, Pilot[None]]]:
    link = link or FakeLink()
    link.incoming += events
    app = ConsoleApp(link, autostart, clock=lambda: 1.0)
    async with app.run_test(size=size) as pilot:
        app.tick()
        await pilot.pause()
        yield app, link, pilot


async def until(pilot: Pilot[None], condition: Callable[[], object]) -> None:
    """Let the console work until something is so; orders run in threads of their own."""
    for _ in range(400):
        if condition():
            return
        await pilot.pause(0.01)
    raise AssertionError("it never came to be")


def last(app: ConsoleApp) -> tuple[int, str]:
    entry = app.state.log.entries[-1]
    return entry.severity, entry.text


def plain(app: ConsoleApp, kind: type[Static]) -> str:
    return str(app.screen_stack[0].query_one(kind).visual)


@pytest.mark.parametrize(
    ("state", "key", "service"),
    [
        (m.TraversalStatus.READY, "s", topics.START),
        (m.TraversalStatus.RUNNING, "space", topics.PAUSE),
        (m.TraversalStatus.PAUSED, "space", topics.RESUME),
        (m.TraversalStatus.RUNNING, "e", topics.ESTOP),
        (m.TraversalStatus.IDLE, "ctrl+e", topics.ESTOP),
        (m.TraversalStatus.ABORTED, "r", topics.RESET),
    ],
)
async def test_a_key_gives_its_order(
    template: Template, state: int, key: str, service: topics.Service[m.CommandRequest, m.CommandResponse]
) -> None:
    events = [*scenes.loaded(template), received(topics.STATUS, scenes.status(template, state))]
    async with console(*events) as (app, link, pilot):
        link.answers[service.name] = m.CommandResponse(success=True, message="as you say")
        await pilot.press(key)
        await until(pilot, lambda: "as you say" in last(app)[1])
        assert link.names() == [service.name]
        assert link.asked[0][1].request_id


async def test_a_refusal_is_shown_with_its_reason(template: Template) -> None:
    async with console(*scenes.loaded(template)) as (app, link, pilot):
        link.answers[topics.START.name] = m.CommandResponse(success=False, message="no plan is loaded")
        await pilot.press("s")
        await until(pilot, lambda: app.state.log.entries[-1].severity == ERROR)
        assert last(app)[1] == "Start refused: no plan is loaded"
        assert any("no plan is loaded" in toast.message for toast in app._notifications)


async def test_nobody_answering_is_shown(template: Template) -> None:
    async with console(*scenes.loaded(template)) as (app, link, pilot):
        link.answers[topics.START.name] = CallFailed("traversal/start: nobody answers; is the service running?")
        await pilot.press("s")
        await until(pilot, lambda: app.state.log.entries[-1].severity == ERROR)
        assert last(app)[1].startswith("Start failed: traversal/start: nobody answers")


async def test_an_emergency_stop_is_repeated_with_the_same_id_until_it_is_answered(template: Template) -> None:
    async with console(*scenes.mid_run(template)) as (app, link, pilot):

        def deaf_twice(request: m.CommandRequest) -> m.CommandResponse:
            if len(link.asked) < 3:
                raise CallFailed("no answer within 0.7 s")
            return m.CommandResponse(success=True, message="stopped")

        link.answers[topics.ESTOP.name] = deaf_twice
        await pilot.press("e")
        await until(pilot, lambda: "stopped" in last(app)[1])
        assert link.names() == [topics.ESTOP.name] * 3
        assert len({request.request_id for _, request in link.asked}) == 1


async def test_an_emergency_stop_passes_an_order_that_hangs(template: Template) -> None:
    async with console(*scenes.mid_run(template)) as (app, link, pilot):
        link.held = threading.Event()
        await pilot.press("space")
        await until(pilot, lambda: topics.PAUSE.name in link.names())
        await pilot.press("space")
        await until(pilot, lambda: "still waiting" in last(app)[1])
        await pilot.press("e", "e")
        await until(pilot, lambda: link.names().count(topics.ESTOP.name) == 2)
        link.held.set()
        await until(pilot, lambda: "Pause: done" in [entry.text for entry in app.state.log.entries])
        assert link.names().count(topics.PAUSE.name) == 1


async def test_abort_asks_first(template: Template) -> None:
    async with console(*scenes.mid_run(template)) as (app, link, pilot):
        await pilot.press("a")
        assert isinstance(app.screen, ConfirmDialog)
        await pilot.press("enter")  # the button that has the focus is the harmless one
        assert not isinstance(app.screen, ConfirmDialog)
        await pilot.press("a", "n")
        await pilot.press("a", "escape")
        assert link.asked == []
        await pilot.press("a", "y")
        await until(pilot, lambda: link.names() == [topics.ABORT.name])


async def test_the_emergency_stop_works_in_every_dialog(template: Template) -> None:
    async with console(*scenes.loaded(template)) as (app, link, pilot):
        for number, (key, dialog) in enumerate(
            (("t", TemplateDialog), ("p", PlanDialog), ("a", ConfirmDialog), ("question_mark", KeysDialog)), start=1
        ):
            await pilot.press(key)
            assert isinstance(app.screen, dialog)
            await pilot.press("ctrl+e")
            await until(pilot, lambda number=number: link.names() == [topics.ESTOP.name] * number)
            assert isinstance(app.screen, dialog)
            await pilot.press("escape")


async def test_speed_goes_up_and_down_in_steps(template: Template) -> None:
    async with console(*scenes.loaded(template)) as (app, link, pilot):
        asked: list[float] = []
        for key, factor in (("]", 50.0), ("]", -1.0), ("]", -1.0), ("[", 50.0), (",", 20.0), (".", 50.0)):
            await pilot.press({"]": "right_square_bracket", "[": "left_square_bracket"}.get(key, key))
            asked.append(factor)
            await until(pilot, lambda: [request.factor for _, request in link.asked] == asked)
            await until(pilot, lambda factor=factor: app.state.speed_factor == factor)
        assert link.names() == [topics.SET_SPEED.name] * 6
        assert "speed 50×" in plain(app, HeaderBar)


async def test_choosing_a_shipped_template(template: Template) -> None:
    async with console(*scenes.up()) as (app, _link, pilot):
        await pilot.press("t")
        names = [str(option.id) for option in app.screen.query_one(OptionList).options]
        assert "soccer-11" in names
        app.screen.query_one(OptionList).highlighted = names.index("soccer-11")
        await pilot.press("enter")
        assert app.state.template is not None
        assert app.state.template.template == template
        assert "Soccer" in str(app.query_one(MapView).border_title)
        assert last(app)[1] == "Template soccer-11: 27 lines, 715.0 m of paint"


async def test_a_template_file_that_is_wrong_is_explained_and_can_be_mended(tmp_path: Path, template: Template) -> None:
    file = tmp_path / "mine.json"
    file.write_text('{"name": "mine", "segments": []}')
    async with console(*scenes.up()) as (app, _link, pilot):
        await pilot.press("t")
        await until(pilot, lambda: isinstance(app.screen, TemplateDialog))
        field = app.screen.query_one(Input)
        field.focus()
        for wrong, problem in ((str(tmp_path / "none.json"), "neither"), (str(file), "segments"), (str(tmp_path), "")):
            field.value = wrong
            await pilot.press("enter")
            assert isinstance(app.screen, TemplateDialog)
            assert problem in str(app.screen.query_one("#problem", Static).visual)
            assert str(app.screen.query_one("#problem", Static).visual)
        file.write_text(template.model_dump_json())
        field.value = str(file)
        await pilot.press("enter")
        assert app.state.template is not None


async def test_planning_with_options(template: Template) -> None:
    async with console(*scenes.up()) as (app, link, pilot):
        app.operator.choose(template, template.model_dump_json())
        link.answers[topics.PLAN_SERVICE.name] = scenes.plan_response(template)
        await pilot.press("p")
        assert isinstance(app.screen, PlanDialog)
        app.screen.query_one("#paint_speed_mps", Input).value = "-1"
        await pilot.press("enter")
        assert isinstance(app.screen, PlanDialog)
        assert "above 0" in str(app.screen.query_one("#problem", Static).visual)
        app.screen.query_one("#paint_speed_mps", Input).value = "0.8"
        await pilot.press("enter")
        await until(pilot, lambda: app.state.path is not None)
        (name, request) = link.asked[0]
        assert name == topics.PLAN_SERVICE.name
        assert request.template_json == template.model_dump_json()
        assert request.options == m.PlanOptions(method="ccd", paint_speed_mps=0.8)
        assert last(app) == (INFO, "Plan: 1.53 km in 26:23")
        await pilot.press("p")
        assert app.screen.query_one("#paint_speed_mps", Input).value == "0.8"


async def test_progress_is_shown_while_planning(template: Template) -> None:
    async with console(*scenes.up()) as (app, link, pilot):
        app.operator.choose(template, template.model_dump_json())
        link.held = threading.Event()
        link.answers[topics.PLAN_SERVICE.name] = scenes.plan_response(template)
        await pilot.press("p", "enter")
        await until(pilot, lambda: link.asked)
        progress = m.Progress(request_id=link.asked[0][1].request_id, stage="transitions", fraction=0.4)
        link.incoming.append(received(topics.PLANNER_PROGRESS, progress))
        await until(pilot, lambda: "planning: transitions 40 %" in plain(app, StatusPanel))
        link.held.set()
        await until(pilot, lambda: app.state.path is not None)
        assert app.state.progress is None


async def test_a_plan_for_a_template_that_was_left_is_dropped(template: Template) -> None:
    async with console(*scenes.up()) as (app, link, pilot):
        app.operator.choose(template, "one")
        link.held = threading.Event()
        link.answers[topics.PLAN_SERVICE.name] = scenes.plan_response(template)
        await pilot.press("p", "enter")
        await until(pilot, lambda: link.asked)
        app.operator.choose(template, "another")
        link.held.set()
        await until(pilot, lambda: app.state.log.entries[-1].severity == ERROR)
        assert app.state.path is None


async def test_a_plan_that_makes_no_sense_is_not_taken(template: Template) -> None:
    nonsense = m.Trajectory(path=m.Path(segments=(m.Segment(id="x"),)))
    async with console(*scenes.up()) as (app, link, pilot):
        app.operator.choose(template, "text")
        link.answers[topics.PLAN_SERVICE.name] = m.PlanResponse(success=True, trajectory=nonsense)
        await pilot.press("p", "enter")
        await until(pilot, lambda: app.state.log.entries[-1].severity == ERROR)
        assert "of no use" in last(app)[1]
        assert app.state.path is None


async def test_loading_hands_over_plan_and_template(template: Template) -> None:
    async with console(*scenes.up()) as (app, link, pilot):
        await pilot.press("l")
        assert last(app)[1] == "Load: plan a template first (p)"
        app.operator.choose(template, template.model_dump_json())
        app.state.planned(scenes.trajectory(template), m.PlanReport())
        link.answers[topics.LOAD.name] = m.LoadResponse(success=True, total_time=100.0)
        await pilot.press("l")
        await until(pilot, lambda: link.asked and app.state.loaded.path is not None)
        link.incoming.append(received(topics.STATUS, scenes.status(template, m.TraversalStatus.READY)))
        await until(pilot, lambda: app.state.path_loaded)
        (name, request) = link.asked[0]
        assert name == topics.LOAD.name
        assert request.trajectory == scenes.trajectory(template)
        assert request.template_json == template.model_dump_json()
        assert last(app)[1] == "Load: takes 1:40"


async def test_no_other_job_is_prepared_while_the_robot_is_on_one(template: Template) -> None:
    async with console(*scenes.mid_run(template)) as (app, _link, pilot):
        for key in ("t", "p"):
            await pilot.press(key)
            assert len(app.screen_stack) == 1
            assert "on a job" in last(app)[1]


async def test_planning_needs_a_template() -> None:
    async with console(*scenes.up()) as (app, _link, pilot):
        await pilot.press("p")
        assert last(app)[1] == "Plan: choose a template first (t)"


async def test_keys_list_names_every_key_of_the_bar() -> None:
    async with console() as (app, _link, pilot):
        await pilot.press("question_mark")
        listed = str(app.screen.query(Static).last().visual)
        for key in ("e, ctrl+e", "t ", "p ", "l ", "s ", "space", "a ", "r ", "[ ,", "f ", "0, home", "ctrl+p", "q "):
            assert key in listed
        await pilot.press("question_mark")
        assert not isinstance(app.screen, KeysDialog)


async def test_quit_asks_while_the_robot_is_on_a_job(template: Template) -> None:
    async with console(*scenes.mid_run(template)) as (app, _link, pilot):
        await pilot.press("q")
        assert isinstance(app.screen, ConfirmDialog)
        await pilot.press("ctrl+q")
        assert len(app.screen_stack) == 2
        await pilot.press("y")
        assert app._exit
    async with console(*scenes.loaded(template)) as (app, _link, pilot):
        await pilot.press("q")
        assert app._exit


async def test_every_command_is_in_the_palette(template: Template) -> None:
    async with console(*scenes.loaded(template)) as (app, link, pilot):
        commands = {command.title: command.callback for command in app.get_system_commands(app.screen)}
        for title, service in (("Start", topics.START), ("Pause", topics.PAUSE), ("Resume", topics.RESUME)):
            commands[title]()
            await until(pilot, lambda service=service: link.names()[-1:] == [service.name])
        commands["Speed max"]()
        await until(pilot, lambda: link.names()[-1] == topics.SET_SPEED.name)
        assert link.asked[-1][1].factor == -1
        assert {"Emergency stop", "Choose template", "Plan", "Load", "Abort", "Reset", "Quit"} <= commands.keys()
        await pilot.press("ctrl+p")
        await until(pilot, lambda: len(app.screen_stack) == 2)
        await pilot.press(*"emergency")
        found = app.screen.query_one(CommandList)
        await until(pilot, lambda: found.option_count == 1)
        await pilot.press("enter", "enter")
        await until(pilot, lambda: link.names()[-1] == topics.ESTOP.name)


async def test_clicking_a_key_presses_it(template: Template) -> None:
    async with console(*scenes.mid_run(template)) as (_app, link, pilot):
        await pilot.click(KeyBar, offset=(3, 0))
        await until(pilot, lambda: link.names() == [topics.ESTOP.name])


async def test_a_dead_service_is_shown_at_once(template: Template) -> None:
    async with console(*scenes.mid_run(template)) as (app, link, pilot):
        link.incoming.append(NodeChanged(topics.ROBOT_SIM, False))
        await until(pilot, lambda: "NO ROBOT" in plain(app, StatusPanel))
        assert "○ robot" in plain(app, HeaderBar)
        assert "○ robot      down" in plain(app, ServicesPanel)
        assert len(app.query_one(LogView).lines) > 0


async def test_paint_is_fetched_on_connecting_and_asked_for_again_until_it_comes(template: Template) -> None:
    now = [0.0]
    link = FakeLink(incoming=[*scenes.up()])
    link.fetch_paint = lambda: setattr(link, "fetches", link.fetches + 1)  # type: ignore[method-assign]
    app = ConsoleApp(link, clock=lambda: now[0])
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: link.fetches == 1)
        now[0] = 0.9
        await pilot.pause(0.2)
        assert link.fetches == 1
        now[0] = 1.5
        await until(pilot, lambda: link.fetches == 2)


async def test_map_keys(template: Template) -> None:
    async with console(*scenes.mid_run(template)) as (app, link, pilot):
        view = app.query_one(MapView)
        home = view.view
        await pilot.press("plus", "plus")
        assert view.view.dot_m < home.dot_m
        await pilot.press("minus")
        await pilot.press("right", "up")
        assert view.view.center_x_m > home.center_x_m
        assert view.view.center_y_m > home.center_y_m
        await pilot.press("f")
        assert view.follow
        assert "following" in str(view.border_title)
        pose = app.state.robot.pose
        assert pose is not None
        assert abs(view.view.center_x_m - pose.x_m) <= view.view.cell_m
        link.incoming.append(received(topics.ODOMETRY, scenes.odometry(0.0, 0.0, 0.0)))
        await until(pilot, lambda: abs(view.view.center_x_m) <= view.view.cell_m)
        await pilot.press("left")
        assert not view.follow
        for key in ("0", "home"):
            await pilot.press("plus", key)
            assert view.view == home


async def test_the_wheel_zooms_at_the_pointer_and_dragging_pans(template: Template) -> None:
    async with console(*scenes.mid_run(template)) as (app, _link, pilot):
        view = app.query_one(MapView)
        column, row = 20, 10  # of the widget; its frame is one cell wide
        await pilot.hover(MapView, offset=(column, row))
        assert str(view.border_subtitle).endswith("m")
        home = view.view
        pointer = home.to_field(column - 0.5, row - 0.5)
        await pilot._post_mouse_events([MouseScrollUp], MapView, offset=(column, row))
        assert view.view.dot_m < home.dot_m
        assert view.view.to_field(column - 0.5, row - 0.5) == pytest.approx(pointer)
        await pilot._post_mouse_events([MouseScrollDown], MapView, offset=(column, row))
        assert view.view.dot_m == pytest.approx(home.dot_m)

        before = view.view
        await pilot.mouse_down(MapView, offset=(column, row))
        view.on_mouse_move(MouseMove(view, column + 5, row - 2, 5, -2, 1, False, False, False))
        await pilot.mouse_up(MapView, offset=(column + 5, row - 2))
        # The field point that was under the pointer still is.
        assert view.view.to_field(25, 8) == pytest.approx(before.to_field(20, 10))


async def test_only_rows_that_changed_are_redrawn(template: Template) -> None:
    async with console(*scenes.mid_run(template)) as (app, link, _pilot):
        view = app.query_one(MapView)
        for row in range(view.size.height):
            view.render_line(row)
        kept = dict(view._strips)
        link.incoming.append(received(topics.ODOMETRY, scenes.odometry(0.0, 0.0, 0.0)))
        app.tick()
        changed = set(kept) - set(view._strips)
        assert 1 <= len(changed) <= 4
        app.tick()
        assert set(kept) - set(view._strips) <= changed


async def test_resizing_to_nothing_and_back(template: Template) -> None:
    async with console(*scenes.mid_run(template)) as (app, _link, pilot):
        for size in ((20, 5), (1, 1), (300, 90), (80, 24), (120, 40)):
            await pilot.resize_terminal(*size)
            app.tick()
            await pilot.pause()
        assert "RUNNING" in plain(app, StatusPanel)


async def test_the_current_line_is_kept_in_view(template: Template) -> None:
    async with console(*scenes.mid_run(template, done=25), size=(80, 24)) as (app, _link, pilot):
        table = app.query_one(SegmentsTable)
        await until(pilot, lambda: table.scroll_offset.y > 0)
        rows = range(table.scroll_offset.y, table.scroll_offset.y + table.content_size.height)
        assert 25 in rows
        assert "25/27" in str(table.border_title)


async def test_starting_by_itself(template: Template) -> None:
    async with console(autostart=AutoStart("soccer-11", 20.0, run=True)) as (app, link, pilot):
        link.answers[topics.PLAN_SERVICE.name] = scenes.plan_response(template)
        await pilot.pause(0.3)
        assert link.asked == []  # nobody is there yet
        assert app.state.template is not None
        link.incoming += scenes.up()
        await until(pilot, lambda: topics.START.name in link.names())
        assert link.names() == [
            topics.PLAN_SERVICE.name,
            topics.LOAD.name,
            topics.SET_SPEED.name,
            topics.START.name,
        ]
        assert link.asked[2][1].factor == 20.0


async def test_starting_by_itself_ends_at_the_first_refusal(template: Template) -> None:
    link = FakeLink(incoming=scenes.up())
    link.answers[topics.PLAN_SERVICE.name] = scenes.plan_response(template)
    link.answers[topics.LOAD.name] = m.LoadResponse(success=False, message="busy")
    async with console(autostart=AutoStart("soccer-11", 20.0, run=True), link=link) as (app, link, pilot):
        await until(pilot, lambda: last(app)[1] == "Load refused: busy")
        await pilot.pause(0.2)
        assert link.names() == [topics.PLAN_SERVICE.name, topics.LOAD.name]


async def test_starting_by_itself_with_a_template_that_is_not_there() -> None:
    link = FakeLink(incoming=scenes.up())
    async with console(autostart=AutoStart("no-such", run=True), link=link) as (app, link, pilot):
        await pilot.pause(0.2)
        assert any("no-such" in entry.text and entry.severity == ERROR for entry in app.state.log.entries)
        assert link.asked == []


async def test_the_emergency_stop_ends_starting_by_itself(template: Template) -> None:
    link = FakeLink(incoming=scenes.up(), held=threading.Event())
    link.answers[topics.PLAN_SERVICE.name] = scenes.plan_response(template)
    async with console(autostart=AutoStart("soccer-11", run=True), link=link) as (app, link, pilot):
        await until(pilot, lambda: link.names() == [topics.PLAN_SERVICE.name])
        await pilot.press("e")
        assert link.held is not None
        link.held.set()
        await until(pilot, lambda: app.state.path is not None)
        await pilot.pause(0.2)
        assert topics.LOAD.name not in link.names()


async def test_starting_by_itself_leaves_a_running_job_alone(template: Template) -> None:
    link = FakeLink(incoming=scenes.mid_run(template))
    async with console(autostart=AutoStart("study-square", 20.0, run=True), link=link) as (app, link, pilot):
        await until(pilot, lambda: any("on a job" in entry.text for entry in app.state.log.entries))
        await pilot.pause(0.2)
        assert link.asked == []
        assert app.state.template is not None
        assert app.state.template.template == template
