"""A console on a fake link, and what a test asks of it."""

import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

from textual.pilot import Pilot
from textual.widgets import Static

from tests.tui.scenes import FakeLink
from touchline.tui.app import ConsoleApp
from touchline.tui.autostart import AutoStart
from touchline.tui.protocol import Incoming


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
        await pilot.pause()
        yield app, link, pilot


async def until(pilot: Pilot[None], condition: Callable[[], object]) -> None:
    """Let the console work until something is so; orders run in threads of their own."""
    deadline = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < deadline, "it never came to be"
        await pilot.pause(0.01)


def last(app: ConsoleApp) -> tuple[int, str]:
    entry = app.state.log.entries[-1]
    return entry.severity, entry.text


def plain(app: ConsoleApp, kind: type[Static]) -> str:
    return str(app.screen_stack[0].query_one(kind).visual)
