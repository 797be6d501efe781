"""The emergency stop: in force until the robot's own status says that it is stopped."""

import threading
from functools import partial

import pytest
from textual import events
from textual.command import CommandList, CommandPalette

from tests.tui import scenes
from tests.tui.console import console, plain, until
from tests.tui.scenes import FakeLink, received
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.template import Template
from touchline.tui import orders
from touchline.tui.dialogs import ConfirmDialog, PlanDialog
from touchline.tui.driver import SturdyDriver
from touchline.tui.keys_dialog import KeysDialog
from touchline.tui.order_registry import Phase
from touchline.tui.protocol import CallFailed, NodeChanged
from touchline.tui.signal_bar import SignalBar
from touchline.tui.stop_screen import StopKey
from touchline.tui.stop_sender import StopSender
from touchline.tui.template_dialog import TemplateDialog

STOPPED = m.TraversalStatus(state=m.TraversalStatus.ESTOPPED)


@pytest.fixture(autouse=True)
def quick_repeats(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tries come every tenth of a second."""
    monkeypatch.setattr("touchline.tui.stop_sender.EVERY_S", 0.1)


def deaf() -> FakeLink:
    """Nobody answers an emergency stop."""
    return FakeLink(answers={topics.ESTOP.name: CallFailed("no answer within 0.4 s")})


def stop_ids(link: FakeLink) -> list[str]:
    return [request.request_id for name, request in link.asked if name == topics.ESTOP.name]


async def test_it_is_repeated_without_end_until_the_status_says_so(template: Template) -> None:
    async with console(*scenes.mid_run(template), link=deaf(), size=(80, 24)) as (app, link, pilot):
        await pilot.press("e")
        await until(pilot, lambda: "E-STOP SENT" in plain(app, SignalBar))
        await until(pilot, lambda: "NOT ACKNOWLEDGED – repeating" in plain(app, SignalBar))
        await until(pilot, lambda: len(link.asked) > 8)
        assert len(set(stop_ids(link))) == 1
        assert link.at_door == [link.asked[0]]
        link.incoming.append(received(topics.STATUS, STOPPED))
        await until(pilot, lambda: "E-STOP ACCEPTED" in plain(app, SignalBar))
        assert app.state.orders.stop.phase is Phase.HELD
        assert app.operator._sender._stops._stop is None  # type: ignore[attr-defined]


async def test_an_answer_while_the_robot_goes_on_is_shown_and_ends_nothing(template: Template) -> None:
    async with console(*scenes.mid_run(template), size=(80, 24), link=FakeLink(stops=False)) as (app, link, pilot):
        await pilot.press("e")
        await until(pilot, lambda: len(link.asked) > 2)
        app.state.now_s += 1.0
        running = scenes.status(template, m.TraversalStatus.RUNNING, 14)
        link.incoming.append(received(topics.STATUS, running))
        await until(pilot, lambda: "E-STOP ANSWERED BUT RUNNING – repeating" in plain(app, SignalBar))


async def test_a_robot_that_comes_back_gets_it_again_with_a_new_id(template: Template) -> None:
    async with console(*scenes.mid_run(template), size=(80, 24), link=deaf()) as (app, link, pilot):
        await pilot.press("e")
        await until(pilot, lambda: link.asked)
        link.incoming.append(NodeChanged(topics.ROBOT_SIM, False))
        await until(pilot, lambda: not app.state.robot_alive)
        link.incoming += [
            NodeChanged(topics.ROBOT_SIM, True),
            received(topics.STATUS, m.TraversalStatus(), publisher="robot-2"),
        ]
        await until(pilot, lambda: len(set(stop_ids(link))) == 2)
        assert app.state.orders.stop.phase is Phase.SENT
        link.incoming.append(received(topics.STATUS, STOPPED, publisher="robot-2"))
        await until(pilot, lambda: app.state.orders.stop.phase is Phase.HELD)


async def test_a_reset_that_was_on_its_way_when_the_stop_was_given_does_not_undo_it(
    template: Template, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("touchline.tui.operator.WITHDRAWN_AFTER_S", 60.0)
    async with console(*scenes.mid_run(template), size=(80, 24), link=deaf()) as (app, link, pilot):
        app.stop_at_once(0.0)  # from the thread that reads the keys, while the console still works off an "r"
        await pilot.press("r")
        await until(pilot, lambda: any("only just been given" in entry.text for entry in app.state.log.entries))
        assert app.state.orders.stop.phase is Phase.SENT
        assert topics.RESET.name not in link.names()


async def test_only_the_operator_withdraws_it(template: Template, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("touchline.tui.operator.WITHDRAWN_AFTER_S", 0.0)
    async with console(*scenes.mid_run(template), size=(80, 24), link=deaf()) as (app, link, pilot):
        await pilot.press("e")
        await until(pilot, lambda: link.asked)
        await pilot.press("q")
        assert isinstance(app.screen, ConfirmDialog)
        await pilot.press("n", "r")
        await until(pilot, lambda: "WITHDRAWN" in plain(app, SignalBar))
        assert app.state.orders.stop.phase is Phase.OFF
        assert topics.RESET.name not in link.names()
        await pilot.press("r")
        await until(pilot, lambda: topics.RESET.name in link.names())


async def test_it_passes_an_order_that_hangs_and_a_try_of_its_own(template: Template) -> None:
    async with console(*scenes.mid_run(template), size=(80, 24)) as (_app, link, pilot):
        link.held = threading.Event()
        await pilot.press("space", "e")
        await until(pilot, lambda: topics.ESTOP.name in link.names())
        await pilot.pause(0.2)  # what is pressed within a tenth of a second counts as one
        await pilot.press("e")
        await until(pilot, lambda: link.names().count(topics.ESTOP.name) == 2)
        assert len(set(stop_ids(link))) == 1
        link.held.set()


@pytest.mark.parametrize("size", [(80, 24), pytest.param((120, 40), marks=pytest.mark.full)])
async def test_key_and_button_work_in_every_dialog(template: Template, size: tuple[int, int]) -> None:
    dialogs = {"t": TemplateDialog, "p": PlanDialog, "question_mark": KeysDialog}
    async with console(*scenes.loaded(template), size=size) as (app, link, pilot):
        for key, dialog in (*dialogs.items(), ("ctrl+p", CommandPalette)):
            await pilot.press(key)
            await until(pilot, lambda dialog=dialog: isinstance(app.screen, dialog))
            await until(pilot, lambda: app.screen.query(StopKey))
            if dialog is CommandPalette:
                await until(pilot, lambda: app.screen.query_one(CommandList).option_count > 20)
            for press in (partial(pilot.press, "ctrl+e"), partial(pilot.click, StopKey)):
                before = len(set(stop_ids(link)))
                await press()
                await until(pilot, lambda before=before: len(set(stop_ids(link))) == before + 1)
                await until(pilot, lambda: app.state.orders.stop.phase is Phase.HELD)
                assert isinstance(app.screen, dialog)
            shown = app.screen.query_one(SignalBar)
            await until(pilot, lambda shown=shown: "E-STOP ACCEPTED" in str(shown.visual))
            assert shown.region.y == 1
            await pilot.press("escape")


def test_it_is_on_its_way_before_another_thread_gets_its_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    link, started = FakeLink(), list[str]()
    monkeypatch.setattr(threading.Thread, "start", lambda thread: started.append(thread.name))
    sender = StopSender(link, lambda _outcome: None)
    for _ in range(2):
        sender.send(orders.command("estop", "1"))
    assert [(name, request.request_id) for name, request in link.posted] == [(topics.ESTOP.name, "1")]
    assert started == ["estop"], "the second press comes so soon that it is the same"
    assert not link.asked


async def test_the_key_is_heard_before_what_was_typed_earlier_which_is_then_left_out(template: Template) -> None:
    async with console(*scenes.mid_run(template), size=(80, 24), link=deaf()) as (app, link, pilot):
        driver = SturdyDriver(app, size=(80, 24))
        sent = []
        driver.send_message = sent.append
        earlier, stop, later = (events.Key(name, None) for name in ("r", "ctrl+e", "space"))
        earlier.time, stop.time, later.time = 1.0, 2.0, 3.0
        driver.process_message(stop)  # in the thread that reads the keys; the console has not seen `earlier` yet
        assert link.posted[0][0] == topics.ESTOP.name
        assert sent == []
        await until(pilot, lambda: sent == [stop])
        app.post_message(earlier)
        app.post_message(later)
        await until(pilot, lambda: topics.PAUSE.name in link.names())
        assert "WITHDRAWN" not in plain(app, SignalBar)
        assert topics.RESET.name not in link.names()
