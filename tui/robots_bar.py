"""Row of robots, if there are several: state and acknowledgement of a stop."""

from __future__ import annotations

from collections.abc import Iterable

from textual import events
from textual.content import Content

from touchline.schemas.messages.touchline import TraversalStatus
from touchline.tui import format, theme
from touchline.tui.order_registry import Phase
from touchline.tui.panels import LinesPanel, badge
from touchline.tui.robots import Robots
from touchline.tui.state import ConsoleState

_LONGEST_NAME = 12
_WORKING = (TraversalStatus.RUNNING, TraversalStatus.PAUSED)


def robots_line(robots: Robots, width: int) -> list[tuple[str, Content]]:
    """Return (name, content) of each robot that fits into `width` cells; the name "" counts the others.

    Robots with an unacknowledged stop, and the selected one, come first.
    """
    shown = {name: _robot(name, state, name == robots.selected_name) for name, state in robots.states.items()}
    urgent = [name for name, state in robots.states.items() if state.orders.stop.phase is Phase.SENT]
    chosen = set(_fitting(dict.fromkeys([*urgent, robots.selected_name, *shown]), shown, width))
    line = [(name, content) for name, content in shown.items() if name in chosen]
    if len(chosen) < len(shown):
        line.append(("", Content.styled(f" +{len(shown) - len(chosen)}", theme.MUTED)))
    return line


def _fitting(names: Iterable[str], shown: dict[str, Content], width: int) -> Iterable[str]:
    room = width - len(" +99")
    for name in names:
        if shown[name].cell_length <= room:
            room -= shown[name].cell_length
            yield name


def _robot(name: str, state: ConsoleState, selected: bool) -> Content:
    known = badge(state)
    text, color = f"{known.mark} {known.text}", known.color
    done = state.share_done
    if done is not None and state.traversal in _WORKING and not state.robot_stale:
        text += f" {format.percent(done)}"
    stop = state.orders.stop.line(state.now_s, known.text if state.robot_alive else "")
    loud = stop is not None and stop.loud
    if stop is not None and stop.loud:
        text = stop.text
    label = format.cut(name, _LONGEST_NAME)
    name_style = f"bold {theme.BLACK} on {theme.SKY}" if selected else f"bold {theme.INK}"
    text_style = f"bold {theme.WHITE} on {theme.STOP}" if loud else color
    return Content.assemble((f" {label} ", name_style), (f" {text} ", text_style), " ")


class RobotsBar(LinesPanel):
    """Widget of the row; a click selects a robot."""

    _spans: tuple[tuple[str, int, int], ...] = ()

    def show(self, robots: Robots) -> None:
        """Redraw the parts that changed."""
        self.display = len(robots.states) > 1
        if not self.display:
            return
        line = robots_line(robots, max(self.size.width, 40))
        column, spans = 0, list[tuple[str, int, int]]()
        for name, content in line:
            spans.append((name, column, column + content.cell_length))
            column += content.cell_length
        self._spans = tuple(spans)
        self.show_lines([Content("").join(content for _, content in line)])

    async def on_click(self, event: events.Click) -> None:
        """Select the robot that was clicked."""
        for name, first, last in self._spans:
            if name and first <= event.x < last:
                await self.app.run_action(f"select({name!r})", self.app)
