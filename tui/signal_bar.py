"""The row below the header, there at every size: what has become of the orders on the left, alerts on the right."""

from __future__ import annotations

from textual.content import Content

from touchline.schemas.messages.touchline import TraversalStatus
from touchline.tui import theme
from touchline.tui.alerts import alerts
from touchline.tui.event_log import INFO
from touchline.tui.order_book import OrderLine
from touchline.tui.panels import LinesPanel
from touchline.tui.state import ConsoleState


def signal_line(state: ConsoleState, width: int) -> Content:
    """The row, `width` cells wide."""
    right = _alerts(state, width)
    return _orders(state, width - right.cell_length) + right


def _orders(state: ConsoleState, width: int) -> Content:
    shown = "" if state.traversal is None or state.robot_stale else theme.STATES[state.traversal].text
    running = shown == theme.STATES[TraversalStatus.RUNNING].text
    line = state.orders.line(state.now_s, shown, running=running)
    if line is None:
        return Content(" " * width)
    text = f" {_mark(line)} {line.text}"
    if len(text) > width:  # what comes first counts most
        text = text[: max(width - 1, 0)] + "…"
    return Content.styled(text.ljust(width), _style(line))


def _mark(line: OrderLine) -> str:
    return theme.SEVERITIES[line.severity].mark


def _style(line: OrderLine) -> str:
    if line.loud:
        return f"bold {theme.WHITE} on {theme.STOP}"
    return theme.INK if line.severity == INFO else f"bold {theme.SEVERITIES[line.severity].color}"


def _alerts(state: ConsoleState, width: int) -> Content:
    """At most half of the row; those that stop the robot come first."""
    found = alerts(state)
    parts = [Content.styled(f" ▲ {alert.text} ", _alert_style(stops=alert.stops)) for alert in found]
    while parts and sum(part.cell_length for part in parts) > max(width // 2, 20):
        parts.pop()
    if len(parts) < len(found):
        parts.append(Content.styled(f" +{len(found) - len(parts)} ", _alert_style(stops=False)))
    return Content("").join(parts)


def _alert_style(*, stops: bool) -> str:
    return f"bold {theme.BLACK} on {theme.ORANGE}" if stops else f"bold {theme.ORANGE}"


class SignalBar(LinesPanel):
    """The row as a widget; every dialog has one, too, in the same place."""

    def show(self, state: ConsoleState) -> None:
        """Redraw what changed."""
        self.show_lines([signal_line(state, max(self.size.width, 40))])
