"""A console on a fake link, and what a test asks of it."""

import time
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import asynccontextmanager
from typing import Any

from textual.pilot import Pilot
from textual.widgets import Static

from tests.tui.scenes import FakeLink
from touchline.tui.app import ConsoleApp
from touchline.tui.autostart import AutoStart
from touchline.tui.map_view import MapView
from touchline.tui.protocol import Incoming
from touchline.tui.reduction import apply_event
from touchline.tui.state import ConsoleState


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
    app.animation_level = "none"  # each step of a scroll would draw the whole screen
    async with app.run_test(size=size) as pilot:
        app.tick()
        await laid_out(pilot)
        yield app, link, pilot


async def until(pilot: Pilot[Any], condition: Callable[[], object]) -> None:
    """Let the console work until something is so; orders run in threads of their own."""
    deadline = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < deadline, "it never came to be"
        await pilot.pause(0.01)


async def laid_out(pilot: Pilot[Any]) -> None:
    """Let the console lay out and draw all that is due, however busy the machine."""

    def at_rest() -> bool:
        screen = pilot.app.screen
        due = screen._layout_required or screen._scroll_required or screen._repaint_required
        return not (due or screen._dirty_widgets or screen._callbacks)

    for _ in range(3):  # what has been laid out may ask for more
        await pilot.pause()
        await until(pilot, at_rest)


async def settle(pilot: Pilot[Any]) -> None:
    """Let the console take what came in, and show all that follows from it."""
    for _ in range(3):
        pilot.app.tick()  # type: ignore[attr-defined]
        await laid_out(pilot)


def reduced(events: Iterable[Incoming], state: ConsoleState | None = None, now_s: float = 1.0) -> ConsoleState:
    """A state that has heard these, without a screen."""
    state = state or ConsoleState()
    for event in events:
        apply_event(state, event, now_s)
    return state


def shown_map(app: ConsoleApp) -> str:
    view = app.query_one(MapView)
    return "\n".join("".join(segment.text for segment in view.render_line(y)) for y in range(view.size.height))


def last(app: ConsoleApp) -> tuple[int, str]:
    entry = app.state.log.entries[-1]
    return entry.severity, entry.text


def plain(app: ConsoleApp, kind: type[Static]) -> str:
    return str(app.screen_stack[0].query_one(kind).visual)
