"""Footer: the keys that fit, the next one highlighted, disabled ones dimmed. A click presses a key."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from textual import events
from textual.content import Content

from touchline.schemas.messages.touchline import TraversalStatus
from touchline.tui import theme
from touchline.tui.alerts import alerts
from touchline.tui.goal_orders import why_no_goal
from touchline.tui.keys import Bar, BarKey, bar
from touchline.tui.panels import LinesPanel, hint
from touchline.tui.state import ConsoleState
from touchline.tui.unfinished_job import offered
from touchline.tui.waiting_robot import asks_way

_USELESS_RANK = 8
_PREPARING = frozenset("tpl")
_DRIVING = frozenset(("space", "g", "a"))
_SUPPLIES = frozenset("ub")
_OF_SEVERAL = frozenset("vox")
"""Keys that are shown only when there are several robots."""
_ANSWERS = frozenset("123")
"""Keys that are shown only while the robot waits before something."""

Placed = list[tuple[BarKey, int, int]]
"""Keys with their first and last column (exclusive)."""


def useless(state: ConsoleState) -> frozenset[str]:
    """Keys whose order would be refused, or change nothing, at present; they still work, and give the reason."""
    if state.replayed:
        return frozenset()
    goals = frozenset("d" if why_no_goal(state) else "")
    useless_now = _out_of_order(state) | _SUPPLIES - {alert.key for alert in alerts(state)} | goals
    return useless_now - {"g"} if offered(state) is not None else useless_now


def _out_of_order(state: ConsoleState) -> frozenset[str]:
    traversal = state.traversal
    if traversal == TraversalStatus.RUNNING:
        return _PREPARING | {"s", "r", "g"}
    if traversal == TraversalStatus.PAUSED:
        return _PREPARING | ({"s", "r"} if state.moves_off_in_s is not None else {"s", "r", "space"})
    if traversal == TraversalStatus.READY:
        return _DRIVING | {"r"}
    if traversal in (TraversalStatus.ABORTED, TraversalStatus.ESTOPPED):
        return _DRIVING | {"s", "l"}
    if traversal == TraversalStatus.DONE:
        return _DRIVING | {"s"}
    return _DRIVING | {"s", "r"}


def layout(state: ConsoleState, width: int) -> Placed:
    """Keys that fit into `width` cells, those that are of use first."""
    idle = useless(state)
    keys = bar(Bar.REPLAY if state.replayed else Bar.JOB if state.drive.goal is None else Bar.AIM)
    hidden = (_OF_SEVERAL if state.alone else frozenset()) | (frozenset() if asks_way(state) else _ANSWERS)
    offered = [key for key in keys if key.key not in hidden]
    return place(offered, width, lambda key: key.rank + (_USELESS_RANK if key.key in idle else 0))


def place(keys: Sequence[BarKey], width: int, rank: Callable[[BarKey], int] = lambda key: key.rank) -> Placed:
    """Keys that fit into `width` cells, in order, each with its first and last column (exclusive)."""
    room, chosen = width, set[BarKey]()
    for key in sorted(keys, key=rank):
        if _width(key) <= room:
            chosen.add(key)
            room -= _width(key)
    placed, column = Placed(), 0
    for key in keys:
        if key in chosen:
            placed.append((key, column, column + _width(key)))
            column += _width(key)
    return placed


def _width(key: BarKey) -> int:
    return len(key.key) + len(key.text) + 3


def label(key: BarKey) -> Content:
    """Render a key."""
    if key.rank == 0:
        return Content.styled(f" {key.key} {key.text} ", theme.STOP_LABEL)
    return Content.assemble((f" {key.key} ", f"bold {theme.SKY}"), (f"{key.text} ", theme.INK))


def keys_line(state: ConsoleState, width: int) -> Content:
    """Render the keys, `width` cells wide."""
    (next_key, _), idle = hint(state), useless(state)
    parts: list[Content] = []
    for key, _, _ in layout(state, width):
        part = label(key)
        if key.rank > 0 and (key.key == next_key or key.key in idle):
            part = Content.styled(part.plain, theme.NEXT_LABEL if key.key == next_key else theme.FAINT)
        parts.append(part)
    return Content("").join(parts)


class PressableKeys(LinesPanel):
    """Row of keys; a click presses one."""

    _placed: Placed = []  # noqa: RUF012, never changed

    def show_placed(self, placed: Placed, shown: Content) -> None:
        """Redraw the parts that changed."""
        self._placed = placed
        self.show_lines([shown])

    async def on_click(self, event: events.Click) -> None:
        """Press the key that was clicked."""
        for key, first, last in self._placed:
            if first <= event.x < last:
                await self.app.run_action(key.action, self.app)


class KeyBar(PressableKeys):
    """Footer of the console."""

    def show(self, state: ConsoleState) -> None:
        """Redraw the parts that changed."""
        width = max(self.size.width, 40)
        self.show_placed(layout(state, width), keys_line(state, width))
