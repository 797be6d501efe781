"""Colours and marks. The hues are Okabe and Ito's, which colour-blind eyes distinguish; every meaning has a mark, too.

Text has a contrast of at least 4.5 to 1 and marks of 3 to 1 (WCAG 2), with all colours, 256 and 16 (`colors.py`); lines
of the map can be told apart with each, and without colours by their shapes (`mono_cells.py`).
"""

from __future__ import annotations

from dataclasses import dataclass

from textual.theme import Theme

from touchline.schemas.messages.touchline import GnssStatus, TraversalStatus
from touchline.tui.node_health import Freshness

BLACK = "#0b100e"
SURFACE = "#111a16"
PANEL = "#18241e"
INK = "#d7e0db"
MUTED = "#9cada4"
FAINT = "#8a9c92"
WHITE = "#ffffff"
ORANGE = "#f0a020"
SKY = "#56b4e9"
GREEN = "#1fb88a"
YELLOW = "#f0e442"
VERMILION = "#e5622b"
PURPLE = "#cc79a7"
STOP = "#b3261e"
"""Red dark enough for white text on it, and red with few colours, too."""
STOPPED_PANEL = "#4a1505"
STOP_LABEL = f"bold reverse {STOP} on {WHITE}"
"""White on red; reversed, so that it stands out without colours, too."""
NEXT_LABEL = f"bold underline {BLACK} on {YELLOW}"
"""Style of the next key; underlined for the same reason."""

TURF = "#13261c"
TURF_STRIPE = "#152b20"
TURF_GRID = "#2b4a39"
TO_PAINT = "#5fa37c"
PATH = "#4b86c8"
LABEL = "#9db5a7"

THEME = Theme(
    name="touchline",
    primary=SKY,
    secondary=GREEN,
    accent=ORANGE,
    warning=ORANGE,
    error=VERMILION,
    success=GREEN,
    foreground=INK,
    background=BLACK,
    surface=SURFACE,
    panel=PANEL,
    dark=True,
    variables={
        "border": "#2f4439",
        "border-blurred": "#2f4439",
        "stopped-panel": STOPPED_PANEL,
        "block-cursor-text-style": "none",
        "button-focus-text-style": "bold underline",
    },
)


@dataclass(frozen=True)
class Badge:
    """Badge of a state: mark, name, and colours."""

    mark: str
    text: str
    color: str
    on: str = BLACK


STATES = {
    TraversalStatus.IDLE: Badge("○", "IDLE", MUTED),
    TraversalStatus.READY: Badge("●", "READY", SKY),
    TraversalStatus.RUNNING: Badge("►", "RUNNING", GREEN),
    TraversalStatus.PAUSED: Badge("‖", "PAUSED", ORANGE),
    TraversalStatus.DONE: Badge("✓", "DONE", WHITE),
    TraversalStatus.ABORTED: Badge("✗", "ABORTED", PURPLE),
    TraversalStatus.ESTOPPED: Badge("■", "E-STOPPED", STOP, WHITE),
}
REPLAY_PAUSED = Badge("‖", "REPLAY PAUSED", ORANGE)
NO_ROBOT = Badge("–", "NO ROBOT", FAINT)
WAITING = Badge("…", "WAITING FOR STATUS", FAINT)
STARTING = Badge("◔", "STARTING", ORANGE)

FRESHNESS = {
    Freshness.LIVE: Badge("●", "live", GREEN),
    Freshness.STARTING: Badge("◔", "starting", ORANGE),
    Freshness.STALE: Badge("▲", "stale", ORANGE),
    Freshness.GONE: Badge("○", "gone", VERMILION),
}

FIXES = {
    GnssStatus.NONE: Badge("○", "no fix", VERMILION),
    GnssStatus.SINGLE: Badge("◔", "single", VERMILION),
    GnssStatus.FLOAT: Badge("◑", "float", ORANGE),
    GnssStatus.FIXED: Badge("●", "fixed", GREEN),
}

SEVERITIES = (Badge("·", "info", MUTED), Badge("▲", "warning", ORANGE), Badge("■", "error", VERMILION))
