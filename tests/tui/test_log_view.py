"""The event log on the screen: only what is in view is drawn, and a repeat costs one line."""

import pytest

from tests.tui.console import console, until
from touchline.tui import log_view
from touchline.tui.event_log import CAPACITY, INFO, WARN, Entry
from touchline.tui.log_view import LogView


def seen(view: LogView) -> str:
    return "\n".join(view.render_line(y).text for y in range(view.scrollable_content_region.height))


async def test_a_repeat_in_a_full_log_wraps_one_entry(monkeypatch: pytest.MonkeyPatch) -> None:
    wrapped: list[Entry] = []
    block = log_view.block
    monkeypatch.setattr(log_view, "block", lambda entry, width: wrapped.append(entry) or block(entry, width))
    async with console(size=(80, 24)) as (app, _link, pilot):
        view, log = app.query_one(LogView), app.state.log
        for number in range(CAPACITY + 50):
            log.add(1.0, INFO, "robot", f"entry {number}")
        view.show(log)
        await until(pilot, lambda: f"entry {CAPACITY + 49}" in seen(view))
        assert len(view.lines) == CAPACITY
        wrapped.clear()
        for _ in range(30):
            log.add(2.0, WARN, "robot", "bump")
            view.show(log)
        assert len(wrapped) <= 61
        await until(pilot, lambda: "bump  ×30" in seen(view))
        assert len(view.lines) == CAPACITY


async def test_who_looks_further_up_is_left_there() -> None:
    async with console(size=(80, 24)) as (app, _link, pilot):
        view, log = app.query_one(LogView), app.state.log
        for number in range(100):
            log.add(1.0, INFO, "robot", f"entry {number}")
        view.show(log)
        await until(pilot, lambda: "entry 99" in seen(view))
        view.scroll_to(y=10, animate=False)
        await until(pilot, lambda: "entry 10" in seen(view))
        log.add(1.0, INFO, "robot", "news")
        view.show(log)
        await pilot.pause()
        assert "entry 10" in seen(view)
        await pilot.resize_terminal(50, 24)
        assert len(view.lines) >= 101
