"""Every dialog at every size: nothing lies over anything else, everything can be reached, no key is cut off."""

from collections.abc import Callable

import pytest
from textual import events
from textual.command import CommandPalette
from textual.geometry import Region
from textual.pilot import Pilot
from textual.screen import Screen
from textual.widget import Widget
from textual.widgets import Input, OptionList, Static

from tests.tui import fleets, pan, scenes
from tests.tui.console import console, last, until
from tests.tui.scenes import FakeLinks
from touchline.schemas import topics
from touchline.schemas.catalogue import load_template, shipped_templates
from touchline.schemas.template import Area, Template
from touchline.schemas.vehicles.shipped import CLAY_ROLLER
from touchline.tui.app import ConsoleApp
from touchline.tui.map_view import MapView
from touchline.tui.signal_bar import SignalBar
from touchline.tui.stop_screen import NoteBar, StopKey
from touchline.tui.template_dialog import TemplateDialog, size_of

SIZES = [
    pytest.param((120, 40), marks=pytest.mark.full),
    (80, 24),
    pytest.param((60, 18), marks=pytest.mark.full),
    (40, 12),
]
#: Below, there is room for one row of a dialog, and less than its tallest.
SEEN = [(120, 40), (80, 24), (60, 18)]
KEYS = {
    "template": ("t",),
    "plan": ("p",),
    "load anew": ("a",),
    "keys": ("question_mark",),
    "goal": ("d", "m"),
    "fleet": ("x",),
    "fleet keys": ("v", "question_mark"),
    "palette": ("ctrl+p",),
}


def app_for(dialog: str, template: Template) -> ConsoleApp:
    if dialog.startswith("fleet"):
        return ConsoleApp(FakeLinks(fleets.fleet(3)), clock=lambda: 1.0)
    if dialog == "goal":
        return ConsoleApp(scenes.FakeLink(incoming=list(scenes.standing())), clock=lambda: 1.0)
    if dialog == "plan":  # the longest: how to cover areas is asked, too
        app = pan.app_with([*scenes.up()])
        app.state.vehicle = CLAY_ROLLER
        app.state.choose_template(pan.template(), pan.template().model_dump_json())
        return app
    return ConsoleApp(scenes.FakeLink(incoming=scenes.loaded(template)), clock=lambda: 1.0)


def parts(screen: Screen[object]) -> tuple[Widget, Widget, Widget]:
    """The box, the row of the orders, the row of the emergency stop."""
    box = screen.query_one("#--container" if isinstance(screen, CommandPalette) else "#dialog")
    row = screen.query_one(StopKey).parent
    assert isinstance(row, Widget)
    return box, screen.query_one(SignalBar), row


async def opened(pilot: Pilot[None], app: ConsoleApp, dialog: str) -> Screen[object]:
    app.tick()
    await pilot.pause()
    await pilot.press(*KEYS[dialog])
    await until(pilot, lambda: app.screen.query(StopKey) and app.screen.query_one(StopKey).region.width)
    await pilot.pause()
    return app.screen


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("dialog", KEYS)
async def test_nothing_is_hidden(template: Template, dialog: str, size: tuple[int, int]) -> None:
    """Nothing lies over anything else, and all of a dialog can be scrolled to."""
    app = app_for(dialog, template)
    async with app.run_test(size=size) as pilot:
        screen = await opened(pilot, app, dialog)
        box, orders, row = parts(screen)
        whole = Region(0, 0, *size)
        assert row.region == Region(0, size[1] - 1, size[0], 1), "nothing beneath it is seen beside the emergency stop"
        assert orders.region == Region(0, 1, size[0], 1)
        assert screen.query_one(StopKey).region.width == len(" ctrl+e E-STOP ")
        for one, other in ((box, row), (box, orders)):
            assert not one.region.overlaps(other.region)
        assert whole.contains_region(box.region)
        assert_whole_keys(screen.query_one(NoteBar), all_of_them=size[0] >= 80)
        if dialog != "palette" and size in SEEN:
            await assert_all_seen(pilot, screen, box)


def assert_whole_keys(note: NoteBar, *, all_of_them: bool) -> None:
    items = ["".join((f"  {key} ", text)) for key, text in note._keys]
    shown = str(note.visual)
    assert shown in ["".join(items[:count]) for count in range(len(items) + 1)]
    assert len(shown) <= note.size.width
    assert not all_of_them or shown == "".join(items)


async def assert_all_seen(pilot: Pilot[None], screen: Screen[object], box: Widget) -> None:
    """Check that the rest can be scrolled to: the box scrolls to the focus, and to its end."""
    seen = set[Widget]()
    wanted = {each for each in box.walk_children(Widget) if each.focusable}
    for each in wanted:
        screen.set_focus(each)
        await pilot.pause()
        box.scroll_to_widget(each, animate=False)
        await pilot.pause()
        seen |= {each} if box.scrollable_content_region.overlaps(each.region) else set()
    assert wanted == seen
    box.scroll_end(animate=False)
    await pilot.pause()
    last = [each for each in box.children if each.region.height][-1]
    assert last.region.bottom <= box.scrollable_content_region.bottom


async def test_the_list_of_keys_scrolls_to_its_last_row(template: Template) -> None:
    async with console(*scenes.loaded(template), size=(80, 24)) as (app, _, pilot):
        await pilot.press("question_mark")
        await until(pilot, lambda: app.screen.query(StopKey))
        box, _, _ = parts(app.screen)
        last = box.query(Static).last()
        await pilot.press("down")
        await until(pilot, lambda: box.scroll_offset.y == 1)
        for key, presses in (("pagedown", 3), ("end", 1)):
            assert last.region.bottom > box.scrollable_content_region.bottom
            await pilot.press(*[key] * presses)
            await until(pilot, lambda: last.region.bottom <= box.scrollable_content_region.bottom)
            await pilot.press("home")
            await until(pilot, lambda: box.scroll_offset.y == 0)


async def choosing(pilot: Pilot[None], app: ConsoleApp) -> OptionList:
    await pilot.press("t")
    await until(pilot, lambda: isinstance(app.screen, TemplateDialog))
    return app.screen.query_one(OptionList)


def names(options: OptionList) -> list[str]:
    return [str(options.get_option_at_index(index).id) for index in range(options.option_count)]


async def test_what_is_typed_finds_a_template_and_enter_takes_it(template: Template) -> None:
    async with console(*scenes.loaded(template), size=(80, 24)) as (app, link, pilot):
        options = await choosing(pilot, app)
        assert names(options) == list(shipped_templates())
        for letter in "tennis":  # faster than the focus moves
            app.post_message(events.Key(letter, letter))
        await until(pilot, lambda: app.screen.query_one(Input).value == "tennis" and names(options) == ["tennis"])
        assert topics.ESTOP.name not in link.names(), "in the field e is a letter"
        await pilot.press("enter")
        await until(pilot, lambda: app.state.template.template.name == "tennis")
        assert last(app)[1] == "Template tennis: 11 lines, 146.1 m of paint"
        assert "Tennis" in str(app.query_one(MapView).border_title)


async def test_words_are_looked_for_in_titles_too_and_arrows_move_in_what_is_found(template: Template) -> None:
    async with console(*scenes.loaded(template), size=(80, 24)) as (app, _, pilot):
        options = await choosing(pilot, app)
        await pilot.press(*"SOCCER 11")
        await until(pilot, lambda: names(options) == ["soccer-11", "soccer-11-grass"])
        await pilot.press("down", "enter")
        await until(pilot, lambda: app.state.template.template.name == "soccer-11-grass")


async def test_what_matches_nothing_is_a_file_and_what_is_wrong_with_it_goes_when_it_is_changed(
    template: Template,
) -> None:
    async with console(*scenes.loaded(template), size=(80, 24)) as (app, _, pilot):
        options = await choosing(pilot, app)
        await pilot.press("down", *"/no/such")
        await until(pilot, lambda: options.option_count == 0)
        await pilot.press("enter")
        problem = app.screen.query_one("#problem", Static)
        await until(pilot, lambda: "/no/such" in str(problem.visual))
        await pilot.press("x")
        await until(pilot, lambda: not str(problem.visual))


async def test_before_anything_is_typed_e_stops_the_robots(template: Template) -> None:
    async with console(*scenes.loaded(template)) as (app, link, pilot):
        await choosing(pilot, app)
        await pilot.press("e")
        await until(pilot, lambda: topics.ESTOP.name in link.names())


def ring(x: float, y: float, side: float) -> tuple[tuple[float, float], ...]:
    return (x, y), (x + side, y), (x + side, y + side), (x, y + side)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: load_template("tennis"), "11 lines, 146.1 m"),
        (lambda: load_template("salt-pan"), "1 area, 4,427 m²"),
        (lambda: load_template("salt-pan-pond"), "1 area, 4,349 m², 1 hole"),
        (
            lambda: Template(
                name="a",
                segments=[{"id": "l", "line": {"start": (0, 0), "end": (1, 0)}}],
                areas=(
                    Area(id="b", outline=ring(0, 0, 10), holes=(ring(1, 1, 1), ring(3, 3, 1))),
                    Area(id="c", outline=ring(20, 0, 10)),
                ),
            ),
            "1 line, 1.0 m, 2 areas, 198 m², 2 holes",
        ),
    ],
)
def test_the_size_of_a_template_is_that_of_its_lines_and_of_its_areas(make: Callable[[], Template], told: str) -> None:
    assert size_of(make()) == told
