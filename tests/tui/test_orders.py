"""Orders to the robot, the emergency stop above all: what is asked, and what is shown of the answer."""

import threading

import pytest

from schemas import messages as m
from schemas import topics
from schemas.template import Template
from tests.tui import scenes
from tests.tui.console import console, last, plain, until
from tests.tui.scenes import received
from tui.dialogs import ConfirmDialog, KeysDialog, PlanDialog, TemplateDialog
from tui.event_log import ERROR
from tui.header import HeaderBar
from tui.protocol import CallFailed


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


async def test_no_press_of_a_speed_key_is_lost_while_an_answer_is_due(template: Template) -> None:
    async with console(*scenes.loaded(template)) as (app, link, pilot):
        link.held = threading.Event()
        for _ in range(3):
            await pilot.press("left_square_bracket")
        await until(pilot, lambda: len(link.asked) == 1)
        link.held.set()
        await until(pilot, lambda: app.state.speed_factor == 2.0)
        assert [request.factor for _, request in link.asked] == [10.0, 2.0]


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
