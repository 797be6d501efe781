"""Finding every order: the list of keys, the key bar, the palette; and leaving."""

from textual.command import CommandList
from textual.widgets import Static

from tests.tui import scenes
from tests.tui.console import console, until
from touchline.schemas import topics
from touchline.schemas.template import Template
from touchline.tui.dialogs import ConfirmDialog
from touchline.tui.key_bar import KeyBar
from touchline.tui.keys import TABLE, Bar
from touchline.tui.keys_dialog import KeysDialog


async def test_keys_list_names_every_key_of_the_bar() -> None:
    async with console() as (app, _link, pilot):
        await pilot.press("question_mark")
        listed = str(app.screen.query("#dialog Static").last(Static).visual)
        for key in TABLE:
            if any(which in key.bars for which in (Bar.JOB, Bar.AIM, Bar.REPLAY)):
                assert f" {key.shown} " in listed, key
        await pilot.press("question_mark")
        assert not isinstance(app.screen, KeysDialog)


async def test_quit_asks_while_the_robot_is_on_a_job(template: Template) -> None:
    async with console(*scenes.mid_run(template), size=(80, 24)) as (app, _link, pilot):
        await pilot.press("q")
        assert isinstance(app.screen, ConfirmDialog)
        await pilot.press("ctrl+q")
        assert len(app.screen_stack) == 2
        await pilot.press("y")
        assert app._exit
    async with console(*scenes.loaded(template), size=(80, 24)) as (app, _link, pilot):
        await pilot.press("q")
        assert app._exit


async def test_every_command_is_in_the_palette(template: Template) -> None:
    async with console(*scenes.loaded(template), size=(80, 24)) as (app, link, pilot):
        commands = {command.title: command.callback for command in app.get_system_commands(app.screen)}
        orders = {
            "Start": topics.START,
            "Pause": topics.PAUSE,
            "Go on": topics.RESUME,
            "Refill tank": topics.REFILL_TANK,
            "Replace battery": topics.REPLACE_BATTERY,
        }
        for title, service in orders.items():
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
    async with console(*scenes.mid_run(template), size=(80, 24)) as (_app, link, pilot):
        await pilot.click(KeyBar, offset=(3, 0))
        await until(pilot, lambda: link.names() == [topics.ESTOP.name])
