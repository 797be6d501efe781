"""Takes the console's picture on a real run: `touchline up` first, then `python docs/console_picture.py OUT.svg`.

Plans and starts the soccer pitch, waits until most of it is painted, and saves what the console shows; with `--watch`
what it shows of a robot or a replay that is on the bus, with `--fleet` the screen of all robots, whatever they do.
Braille is drawn as dots, because few fonts in browsers have it.
"""

from __future__ import annotations

import asyncio
import html
import re
import sys
from pathlib import Path

from touchline.schemas import topics
from touchline.tui.app import ConsoleApp
from touchline.tui.autostart import AutoStart
from touchline.tui.link import BusConfig, open_links
from touchline.tui.state import ConsoleState

SIZE = (120, 40)
COVERAGE_PCT = 62.0
SPEED = 50.0
DOT_RADIUS = 1.9
# A full circle from its leftmost point.
DOT = f"a{DOT_RADIUS} {DOT_RADIUS} 0 1 1 0 .01z"
# Places of a braille character's eight bits as (column, row).
PLACES = ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (0, 3), (1, 3))


async def take() -> str:
    """The console as SVG once enough is painted."""
    with open_links(BusConfig.from_environment(), topics.CONSOLE) as links:
        app = ConsoleApp(links, AutoStart("soccer-11", SPEED, run=True))
        async with app.run_test(size=SIZE) as pilot:
            while not enough(app.state):
                await pilot.pause(0.05)
            picture = app.export_screenshot(title="touchline tui")
            app.action_command("abort")
            await pilot.pause(1.0)
    return picture


async def take_as_it_is(*keys: str) -> str:
    """The console as SVG: five seconds after it was opened, and five more after keys were pressed, if any."""
    with open_links(BusConfig.from_environment(), topics.CONSOLE, everyone=bool(keys)) as links:
        app = ConsoleApp(links)
        async with app.run_test(size=SIZE) as pilot:
            await pilot.pause(5.0)
            if keys:
                await pilot.press(*keys)
                await pilot.pause(5.0)
            return app.export_screenshot(title="touchline tui")


def enough(state: ConsoleState) -> bool:
    """Whether the picture shows a job well under way."""
    truth = state.robot.truth
    return state.busy and truth is not None and truth.coverage_pct >= COVERAGE_PCT


def without_webfont(svg: str) -> str:
    """Local monospace fonts only."""
    svg = re.sub(r"@font-face\s*{.*?}", "", svg, flags=re.DOTALL)
    return svg.replace("Fira Code", "DejaVu Sans Mono")


def with_dots(svg: str) -> str:
    """Braille characters replaced by circles."""
    return re.sub(r"<text([^>]*)>(.*?)</text>", _text, svg, flags=re.DOTALL)


def _text(match: re.Match[str]) -> str:
    attributes, text = match.group(1), html.unescape(match.group(2))
    if not any(0x2800 <= ord(character) < 0x2900 for character in text):
        return match.group(0)
    left, baseline, length = (
        float(re.search(rf'\b{name}="([\d.]+)"', attributes).group(1)) for name in ("x", "y", "textLength")
    )
    style = re.search(r'class="([^"]+)"', attributes).group(1)
    width = length / len(text)
    height, top = width * 2, baseline - width * 1.52
    dots: list[str] = []
    for index, character in enumerate(text):
        bits = ord(character) - 0x2800 if 0x2800 <= ord(character) < 0x2900 else 0
        for bit, (column, row) in enumerate(PLACES):
            if bits >> bit & 1:
                x = left + width * (index + 0.25 + 0.5 * column)
                y = top + height * (0.125 + 0.25 * row)
                dots.append(f"M{x - DOT_RADIUS:.1f} {y:.1f}{DOT}")
    parts = [f'<path class="{style}" d="{"".join(dots)}"/>'] if dots else []
    rest = "".join(" " if 0x2800 <= ord(character) < 0x2900 else character for character in text)
    if rest.strip():
        parts.append(f"<text{attributes}>{html.escape(rest).replace(' ', '&#160;')}</text>")
    return "".join(parts)


if __name__ == "__main__":
    keys = {"--watch": (), "--fleet": ("v",)}.get(sys.argv[-1])
    picture = asyncio.run(take() if keys is None else take_as_it_is(*keys))
    Path(sys.argv[1]).write_text(with_dots(without_webfont(picture)), encoding="utf-8")
