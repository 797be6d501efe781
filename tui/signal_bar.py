"""Row below the header: orders on the left, alerts on the right."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from textual.content import Content

from touchline.schemas.messages.touchline import TraversalStatus
from touchline.tui import theme
from touchline.tui.alerts import alerts
from touchline.tui.event_log import INFO
from touchline.tui.order_registry import OrderLine
from touchline.tui.panels import LinesPanel
from touchline.tui.robots import Robots
from touchline.tui.state import ConsoleState


def signal_line(
    state: ConsoleState, width: int, others: Mapping[str, ConsoleState] | None = None, name: str = ""
) -> Content:
    """Render the row about a robot, `width` cells wide, with unacknowledged emergency stops of the `others`.

    `name` precedes the orders, where several robots are in view.
    """
    right = _alerts(state, width)
    if state.replayed:
        right += Content.styled(f" {state.replay.mark} ", f"bold {theme.BLACK} on {theme.PURPLE}")
    line = _line(state)
    if line is not None and name:
        line = replace(line, text=f"{name}{line.text}")
    if (elsewhere := _stopping(others or {})) and (line is None or not line.loud):
        line = elsewhere
    elif elsewhere is not None and line is not None:
        line = OrderLine(line.severity, f"{line.text}; {elsewhere.text}", loud=True)
    return _shown(line, width - right.cell_length) + right


def _stopping(others: Mapping[str, ConsoleState]) -> OrderLine | None:
    """Emergency stops that robots out of view have not acknowledged."""
    lines = {name: state.orders.stop.line(state.now_s, _badge_text(state)) for name, state in others.items()}
    loud = [(name, line) for name, line in lines.items() if line is not None and line.loud]
    if not loud:
        return None
    name, line = loud[0]
    if len(loud) == 1:
        return OrderLine(line.severity, f"{name}: {line.text}", loud=True)
    text = f"E-STOP NOT ACKNOWLEDGED BY {len(loud)}: {', '.join(name for name, _ in loud)}"
    return OrderLine(line.severity, text, loud=True)


def _badge_text(state: ConsoleState) -> str:
    return "" if state.traversal is None or state.robot_stale else theme.STATES[state.traversal].text


def _line(state: ConsoleState) -> OrderLine | None:
    shown = _badge_text(state)
    running = shown == theme.STATES[TraversalStatus.RUNNING].text
    return state.orders.line(state.now_s, shown, running=running)


def _shown(line: OrderLine | None, width: int) -> Content:
    if line is None:
        return Content(" " * width)
    text = f" {_mark(line)} {line.text}"
    if len(text) > width:  # the beginning is the most important part
        text = text[: max(width - 1, 0)] + "…"
    return Content.styled(text.ljust(width), _style(line))


def _mark(line: OrderLine) -> str:
    return theme.SEVERITIES[line.severity].mark


def _style(line: OrderLine) -> str:
    if line.loud:
        return theme.STOP_LABEL
    return theme.INK if line.severity == INFO else f"bold {theme.SEVERITIES[line.severity].color}"


def _alerts(state: ConsoleState, width: int) -> Content:
    """Render the alerts in at most half of the row, those that stop the robot first."""
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
    """Widget of the row; every dialog has one, too, in the same place."""

    def __init__(self, *, named: bool = False) -> None:
        """Create the row, with the name of the robot in view if `named`."""
        super().__init__()
        self._named = named

    def show(self, robots: Robots) -> None:
        """Redraw the parts that changed."""
        name = f"{robots.selected_name}: " if self._named else ""
        self.show_lines([signal_line(robots.selected, max(self.size.width, 40), robots.others, name)])
