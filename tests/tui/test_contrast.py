"""Whether everything can be read and told apart: contrasts after WCAG 2, with all colours and with a terminal's 16."""

from itertools import combinations

import pytest
from rich._palettes import STANDARD_PALETTE
from rich.color import Color, ColorSystem

from touchline.tui import theme
from touchline.tui.cells_view import COLORS
from touchline.tui.map_raster import Ink

TEXT, MARK = 4.5, 3.0
SYSTEMS = (ColorSystem.TRUECOLOR, ColorSystem.EIGHT_BIT, ColorSystem.STANDARD)
GROUNDS = (theme.BLACK, theme.SURFACE, theme.PANEL)
TEXTS = (theme.INK, theme.MUTED, theme.FAINT, theme.WHITE, theme.ORANGE, theme.SKY, theme.GREEN, theme.YELLOW)
BADGES = [*theme.STATES.values(), theme.NO_ROBOT, theme.WAITING]


def rgb(color: str, system: ColorSystem) -> tuple[int, int, int]:
    """As a terminal of this kind shows it, as Rich translates it."""
    shown = Color.parse(color).downgrade(system)
    if system == ColorSystem.STANDARD:
        assert shown.number is not None
        return tuple(STANDARD_PALETTE[shown.number])
    return tuple(shown.get_truecolor())


def luminance(color: tuple[int, int, int]) -> float:
    shares = [value / 255 for value in color]
    red, green, blue = (share / 12.92 if share <= 0.03928 else ((share + 0.055) / 1.055) ** 2.4 for share in shares)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one: str, other: str, system: ColorSystem) -> float:
    dark, light = sorted(luminance(rgb(color, system)) for color in (one, other))
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("system", SYSTEMS)
def test_text_can_be_read(system: ColorSystem) -> None:
    pairs = [(color, ground) for color in (*TEXTS, theme.VERMILION) for ground in GROUNDS]
    pairs += [(badge.on, badge.color) for badge in BADGES]
    pairs += [(badge.color, ground) for badge in (*theme.SEVERITIES, *theme.FIXES.values()) for ground in GROUNDS]
    pairs += [(color, theme.STOPPED_PANEL) for color in (theme.INK, theme.MUTED)]
    pairs += [(theme.BLACK, theme.GREEN), (theme.BLACK, theme.YELLOW), (theme.WHITE, theme.STOP)]
    pairs += [(theme.LABEL, turf) for turf in (theme.TURF, theme.TURF_STRIPE)]
    assert [pair for pair in pairs if contrast(*pair, system) < TEXT] == []


@pytest.mark.parametrize("system", SYSTEMS)
def test_marks_can_be_seen(system: ColorSystem) -> None:
    """The points of the map's grid and the empty part of a bar are decoration."""
    marks = [color for ink, (color, _) in COLORS.items() if ink not in (Ink.GROUND, Ink.GRID)]
    pairs = [(mark, ground) for mark in marks if " on " not in mark for ground in (theme.TURF, theme.TURF_STRIPE)]
    pairs += [tuple(mark.split(" on ")) for mark in marks if " on " in mark]
    pairs += [(color, theme.STOPPED_PANEL) for color in (theme.GREEN, theme.VERMILION)]
    assert [pair for pair in pairs if contrast(*pair, system) < MARK] == []


@pytest.mark.parametrize("system", SYSTEMS)
def test_lines_of_the_map_can_be_told_apart(system: ColorSystem) -> None:
    lines = (Ink.PATH, Ink.CURRENT_PATH, Ink.TEMPLATE, Ink.CURRENT, Ink.PAINT)
    shown = {ink: rgb(COLORS[ink][0], system) for ink in (*lines, Ink.GRID)}
    assert [(a.name, b.name) for a, b in combinations(shown, 2) if shown[a] == shown[b]] == []
