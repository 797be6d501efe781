"""Legibility: contrasts after WCAG 2 and ΔE, on the palettes that terminals have."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import Any, cast

import numpy as np
import pytest
from rich._palettes import STANDARD_PALETTE
from rich.color import Color, ColorSystem
from rich.segment import Segment
from rich.style import Style
from textual.color import BLACK

from tests.tui import scenes
from tests.tui.console import console
from touchline.tui import theme
from touchline.tui.cells_view import COLORS, cell_styles
from touchline.tui.colors import Sixteen, has_colors, has_sixteen_colors, sixteen_style
from touchline.tui.map_raster import MISSED_MARK, Cells, Ink
from touchline.tui.map_view import MapView
from touchline.tui.mono_cells import EVERY_OTHER_DOT, STYLES, in_shapes
from touchline.tui.raster import BRAILLE_BASE

TEXT, MARK = 4.5, 3.0
GROUNDS = (theme.BLACK, theme.SURFACE, theme.PANEL)
TEXTS = (theme.INK, theme.MUTED, theme.FAINT, theme.WHITE, theme.ORANGE, theme.SKY, theme.GREEN, theme.YELLOW)
BADGES = [*theme.STATES.values(), theme.NO_ROBOT, theme.WAITING]


XTERM = (
    "000000 cd0000 00cd00 cdcd00 0000ee cd00cd 00cdcd e5e5e5 7f7f7f ff0000 00ff00 ffff00 5c5cff ff00ff 00ffff ffffff"
)
"""Of XTerm; VGA's, which the Linux console has, is Rich's own."""
TANGO = (
    "000000 cc0000 4e9a06 c4a000 3465a4 75507b 06989a d3d7cf 555753 ef2929 8ae234 fce94f 729fcf ad7fa8 34e2e2 eeeeec"
)
"""Of GNOME's terminal."""


def palette(text: str) -> list[tuple[int, int, int]]:
    return [(int(each[:2], 16), int(each[2:4], 16), int(each[4:], 16)) for each in text.split()]


SIXTEEN_COLORS = {
    "xterm": palette(XTERM),
    "vga": [tuple(STANDARD_PALETTE[number]) for number in range(16)],
    "tango": palette(TANGO),
}
SYSTEMS = ("all", "256", *SIXTEEN_COLORS)


def rgb(color: str, system: str) -> tuple[int, int, int]:
    """As a terminal of this kind shows it."""
    if system in SIXTEEN_COLORS:
        shown = sixteen_style(Style.parse(color)).color
        assert shown is not None and shown.number is not None, f"{color} has a number of its own"
        return SIXTEEN_COLORS[system][shown.number]
    parsed = Color.parse(color)
    return tuple((parsed.downgrade(ColorSystem.EIGHT_BIT) if system == "256" else parsed).get_truecolor())


def luminance(color: tuple[int, int, int]) -> float:
    shares = [value / 255 for value in color]
    red, green, blue = (share / 12.92 if share <= 0.03928 else ((share + 0.055) / 1.055) ** 2.4 for share in shares)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one: str, other: str, system: str) -> float:
    dark, light = sorted(luminance(rgb(color, system)) for color in (one, other))
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("system", SYSTEMS)
def test_text_can_be_read(system: str) -> None:
    pairs = [(color, ground) for color in (*TEXTS, theme.VERMILION) for ground in GROUNDS]
    pairs += [(badge.on, badge.color) for badge in BADGES]
    pairs += [(badge.color, ground) for badge in (*theme.SEVERITIES, *theme.FIXES.values()) for ground in GROUNDS]
    pairs += [(color, theme.STOPPED_PANEL) for color in (theme.INK, theme.MUTED)]
    pairs += [(theme.BLACK, theme.GREEN), (theme.BLACK, theme.YELLOW), (theme.WHITE, theme.STOP)]
    pairs += [(theme.LABEL, turf) for turf in (theme.TURF, theme.TURF_STRIPE)]
    assert [pair for pair in pairs if contrast(*pair, system) < TEXT] == []


@pytest.mark.parametrize("system", SYSTEMS)
def test_marks_can_be_seen(system: str) -> None:
    """The points of the map's grid and the empty part of a bar are decoration."""
    marks = [color for ink, (color, _) in COLORS.items() if ink not in (Ink.GROUND, Ink.GRID)]
    pairs = [(mark, ground) for mark in marks if " on " not in mark for ground in (theme.TURF, theme.TURF_STRIPE)]
    pairs += [tuple(mark.split(" on ")) for mark in marks if " on " in mark]
    pairs += [(color, theme.STOPPED_PANEL) for color in (theme.GREEN, theme.VERMILION)]
    assert [pair for pair in pairs if contrast(*pair, system) < MARK] == []


def lab(color: tuple[int, int, int]) -> tuple[float, float, float]:
    """CIE L*a*b* of an sRGB colour, D65."""
    shares = [value / 255 for value in color]
    r, g, b = (share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares)
    x, y, z = (
        (0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.95047,
        0.2126 * r + 0.7152 * g + 0.0722 * b,
        (0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.08883,
    )
    f, g_, h = (value ** (1 / 3) if value > 0.008856 else 7.787 * value + 16 / 116 for value in (x, y, z))
    return 116 * g_ - 16, 500 * (f - g_), 200 * (g_ - h)


def difference(one: str, other: str, system: str) -> float:
    """ΔE*ab (CIE 1976); about 2 is just seen side by side."""
    return math.dist(lab(rgb(one, system)), lab(rgb(other, system)))


LINES = (Ink.PATH, Ink.CURRENT_PATH, Ink.TEMPLATE, Ink.CURRENT, Ink.LIMIT, Ink.PAINT, Ink.MISSED)
SHAPES = (*LINES, Ink.SLOW_ZONE, Ink.STOP_ZONE, Ink.SEEN)
"""The outline of an obstacle has the colour of missed ground, which is a cross."""
CLEARLY = 20.0
"""ΔE of thin lines, a few dots wide, that nobody takes for one another."""


@pytest.mark.parametrize("system", SYSTEMS)
def test_lines_of_the_map_can_be_told_apart(system: str) -> None:
    pairs = combinations(LINES, 2)
    alike = [(a.name, b.name) for a, b in pairs if difference(COLORS[a][0], COLORS[b][0], system) < CLEARLY]
    assert alike == []
    assert difference(COLORS[Ink.PAINT][0], COLORS[Ink.TEMPLATE][0], system) > 2 * CLEARLY
    assert COLORS[Ink.SEEN] == (COLORS[Ink.MISSED][0], "")


@pytest.mark.parametrize("system", SYSTEMS)
def test_the_emergency_stop_is_red_and_beside_no_label_like_it(system: str) -> None:
    red, green, blue = rgb(theme.STOP, system)
    assert red > 2.5 * max(green, blue)
    others = (theme.YELLOW, theme.ORANGE, theme.GREEN, theme.SKY, theme.PURPLE, theme.MUTED, theme.PANEL)
    assert [other for other in others if difference(theme.STOP, other, system) < 2 * CLEARLY] == []


def test_without_colours_lines_of_the_map_have_shapes_of_their_own() -> None:
    """A row of each: seven dots of a line across cells."""
    inks = np.array([SHAPES], dtype=np.uint8)
    codes = np.full(inks.shape, BRAILLE_BASE + 0b1001, dtype=np.uint32)  # both upper dots
    codes[inks == Ink.MISSED] = ord(MISSED_MARK)
    shown = in_shapes(Cells(codes, inks, np.zeros(len(SHAPES), dtype=np.bool_)))
    styles = cell_styles(STYLES)
    looks = {
        (chr(code), styles[2 * ink].reverse, styles[2 * ink].bold)
        for code, ink in zip(shown.codes[0].tolist(), inks[0].tolist(), strict=True)
    }
    assert len(looks) == len(SHAPES)
    characters = {name: chr(code) for name, code in zip(SHAPES, shown.codes[0].tolist(), strict=True)}
    assert characters[Ink.PAINT] != characters[Ink.TEMPLATE], "not by boldness alone"


def test_to_paint_is_never_nothing() -> None:
    bits = np.arange(1, 256, dtype=np.uint32)[None, :]
    cells = Cells(bits + BRAILLE_BASE, np.full(bits.shape, Ink.TEMPLATE, dtype=np.uint8), np.zeros(255, dtype=np.bool_))
    assert (in_shapes(cells).codes > BRAILLE_BASE).all()


@pytest.mark.parametrize(("environment", "shapes"), [({}, False), ({"NO_COLOR": "1"}, True)])
async def test_the_map_takes_shapes_where_there_are_no_colours(
    monkeypatch: pytest.MonkeyPatch, environment: dict[str, str], shapes: bool
) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    async with console(*scenes.mid_run(scenes.pitch()), size=(80, 24)) as (app, _, pilot):
        await pilot.pause()
        view = app.query_one(MapView)
        assert view.shapes == shapes
        assert view.cells is not None
        to_paint = view.cells.codes[view.cells.inks == Ink.TEMPLATE] - BRAILLE_BASE
        dotted = (to_paint & ~np.uint32(EVERY_OTHER_DOT)) == 0
        assert dotted.mean() > 0.8 if shapes else dotted.mean() < 0.8


def test_labels_that_count_stand_out_without_colours() -> None:
    assert Style.parse(theme.STOP_LABEL).reverse
    assert Style.parse(theme.NEXT_LABEL).underline


@dataclass
class Terminal:
    """An application's knowledge of its terminal."""

    color_system: str | None
    no_color: bool = False
    is_headless: bool = False

    @property
    def console(self) -> Terminal:
        return self


def test_a_terminal_of_16_colours_gets_the_theme_s_own_choice() -> None:
    for system, colors, sixteen in (("standard", True, True), ("256", True, False), (None, False, False)):
        terminal: Any = Terminal(system)
        assert (has_colors(terminal), has_sixteen_colors(terminal)) == (colors, sixteen)
    unwanted: Any = Terminal("standard", no_color=True)
    assert not has_colors(unwanted) and not has_sixteen_colors(unwanted)
    assert has_colors(cast(Any, Terminal(None, is_headless=True)))
    segments = Sixteen().apply([Segment("x", Style.parse(f"{theme.TO_PAINT} on {theme.TURF}")), Segment("y")], BLACK)
    assert segments[0].style == Style.parse("color(2) on color(0)") and segments[1].style is None
