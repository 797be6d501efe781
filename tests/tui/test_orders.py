"""Orders to the robot: what is asked, and what is shown of the answer. The emergency stop: test_stop."""

import threading

from tests.tui import scenes
from tests.tui.console import console, last, plain, until
from tests.tui.scenes import received
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.template import Template
from touchline.tui.dialogs import ConfirmDialog
from touchline.tui.event_log import ERROR
from touchline.tui.header import HeaderBar
from touchline.tui.protocol import CallFailed
from touchline.tui.signal_bar import SignalBar


async def test_a_key_gives_its_order(template: Template) -> None:
    async with console(*scenes.loaded(template), size=(80, 24)) as (app, link, pilot):
        for state, key, service in (
            (m.TraversalStatus.READY, "s", topics.START),
            (m.TraversalStatus.RUNNING, "space", topics.PAUSE),
            (m.TraversalStatus.PAUSED, "g", topics.RESUME),
            (m.TraversalStatus.PAUSED, "u", topics.REFILL_TANK),
            (m.TraversalStatus.PAUSED, "b", topics.REPLACE_BATTERY),
            (m.TraversalStatus.ABORTED, "r", topics.RESET),
            (m.TraversalStatus.RUNNING, "e", topics.ESTOP),
        ):
            link.asked.clear()
            link.answers[service.name] = m.CommandResponse(success=True, message=f"as {key} says")
            link.incoming.append(received(topics.STATUS, scenes.status(template, state)))
            app.tick()
            await pilot.press(key)
            await until(pilot, lambda key=key: any(f"as {key} says" in each.text for each in app.state.log.entries))
            assert link.names() == [service.name]
            assert link.asked[0][1].request_id


async def test_a_refusal_and_silence_are_shown_with_their_reasons_and_without_toasts(template: Template) -> None:
    """Toasts would cover the badge or the key bar, and fifty of them keep the console from its work for seconds."""
    async with console(*scenes.loaded(template), size=(80, 24)) as (app, link, pilot):
        link.answers[topics.START.name] = m.CommandResponse(success=False, message="no plan is loaded")
        await pilot.press("s")
        await until(pilot, lambda: app.state.log.entries[-1].severity == ERROR)
        assert last(app)[1] == "Start refused: no plan is loaded"
        assert "Start refused: no plan is loaded" in plain(app, SignalBar)
        link.answers[topics.START.name] = CallFailed(
            "traversal/start: nobody answers; the service does not run, or hangs"
        )
        await pilot.press("s")
        await until(pilot, lambda: last(app)[1].startswith("Start not answered: traversal/start: nobody answers"))
        await pilot.press("p", "escape", "ctrl+c")
        assert not app._notifications


async def test_abort_asks_first(template: Template) -> None:
    async with console(*scenes.mid_run(template), size=(80, 24)) as (app, link, pilot):
        await pilot.press("a")
        assert isinstance(app.screen, ConfirmDialog)
        await pilot.press("enter")  # the button that has the focus is the harmless one
        assert not isinstance(app.screen, ConfirmDialog)
        await pilot.press("a", "n")
        await pilot.press("a", "escape")
        assert link.asked == []
        await pilot.press("a", "y")
        await until(pilot, lambda: link.names() == [topics.ABORT.name])


async def test_no_press_of_a_speed_key_is_lost_while_an_answer_is_due(template: Template) -> None:
    async with console(*scenes.loaded(template), size=(80, 24)) as (app, link, pilot):
        link.held = threading.Event()
        for _ in range(3):
            await pilot.press("left_square_bracket")
        await until(pilot, lambda: len(link.asked) == 1)
        link.held.set()
        await until(pilot, lambda: app.state.speed_factor == 2.0)
        assert [request.factor for _, request in link.asked] == [10.0, 2.0]


async def test_speed_goes_up_and_down_in_steps(template: Template) -> None:
    async with console(*scenes.loaded(template), size=(80, 24)) as (app, link, pilot):
        asked: list[float] = []
        for key, factor in (("]", 50.0), ("]", -1.0), ("]", -1.0), ("[", 50.0), (",", 20.0), (".", 50.0)):
            await pilot.press({"]": "right_square_bracket", "[": "left_square_bracket"}.get(key, key))
            asked.append(factor)
            await until(pilot, lambda: [request.factor for _, request in link.asked] == asked)
            await until(pilot, lambda factor=factor: app.state.speed_factor == factor)
        assert link.names() == [topics.SET_SPEED.name] * 6
        await until(pilot, lambda: "speed 50×" in plain(app, HeaderBar))


async def test_a_held_space_bar_is_one_pause_and_never_resumes(template: Template) -> None:
    async with console(*scenes.mid_run(template), size=(80, 24)) as (app, link, pilot):
        await pilot.press(*["space"] * 5)
        await until(pilot, lambda: app.state.orders.accepted_within("pause", 1.0, app.state.now_s))
        await pilot.press(*["space"] * 5)
        paused = scenes.status(template, m.TraversalStatus.PAUSED, reason="paused by the operator")
        by_operator = m.PauseStatus(cause=m.PauseStatus.OPERATOR, source="operator")
        link.incoming += [received(topics.PAUSE_STATUS, by_operator), received(topics.STATUS, paused)]
        await until(pilot, lambda: app.state.paused_by_hand)
        await pilot.press(*["space"] * 5)
        assert link.names() == [topics.PAUSE.name]
        assert "g goes on" in plain(app, SignalBar)


async def test_an_order_that_is_under_way_is_not_repeated(template: Template) -> None:
    async with console(*scenes.loaded(template), size=(80, 24)) as (app, link, pilot):
        link.held = threading.Event()
        entries = len(app.state.log.entries)
        await pilot.press(*["r"] * 50)
        await until(pilot, lambda: link.asked)
        assert link.names() == [topics.RESET.name]
        assert len(app.state.log.entries) == entries, "a key that is held down costs nothing"
        assert "Reset sent" in plain(app, SignalBar)
        link.held.set()


async def test_a_pause_is_sent_again_and_said_to_be_unanswered(template: Template) -> None:
    async with console(*scenes.mid_run(template), size=(80, 24)) as (app, link, pilot):
        link.answers[topics.PAUSE.name] = CallFailed("no answer within 1.0 s")
        await pilot.press("space")
        await until(pilot, lambda: last(app)[1] == "Pause not answered after 3 tries: no answer within 1.0 s")
        assert link.names() == [topics.PAUSE.name] * 3
        assert len({request.request_id for _, request in link.asked}) == 1
        assert "Pause not answered after 3 tries" in plain(app, SignalBar)
