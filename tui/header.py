"""Header line: robot, processes, sim time and speed."""

from __future__ import annotations

from textual.content import Content

from touchline.schemas import topics
from touchline.schemas.messages.touchline import TraversalStatus
from touchline.tui import format, theme
from touchline.tui.node_health import Freshness
from touchline.tui.panels import NODE_LABELS, LinesPanel
from touchline.tui.state import EXPECTED_NODES, ConsoleState


def header_line(state: ConsoleState, width: int) -> Content:
    """Render the header, `width` cells wide."""
    left = Content.assemble((" TOUCHLINE ", f"bold {theme.BLACK} on {theme.GREEN}"), " ")
    for name in EXPECTED_NODES:
        left += _node(state, topics.REPLAY if state.replayed and name == topics.ROBOT_SIM else name)
    robot = state.robot
    clock = format.duration(robot.sim_time_s)
    asked, measured = state.speed_factor, state.real_time_factor
    speed = format.factor(asked if asked is not None else measured)
    if asked is not None and measured is not None:
        speed += f" ({format.factor(measured)})"
    right = Content.assemble(("sim ", theme.MUTED), f"{clock}   ", ("speed ", theme.MUTED), f"{speed} ")
    if state.robot_stale:
        right = Content.styled(right.plain, theme.MUTED)
    gap = max(width - left.cell_length - right.cell_length, 1)
    return left + Content(" " * gap) + right


def _node(state: ConsoleState, name: str) -> Content:
    """Render a process: green only while it reports."""
    node, label = state.nodes[name], NODE_LABELS.get(name, name)
    mark = theme.FRESHNESS[node.freshness(state.now_s)]
    if node.freshness(state.now_s) is Freshness.STALE:
        text = (f"{label} {node.silence_s(state.now_s):.0f} s?  ", f"bold {mark.color}")
    else:
        text = (f"{label}  ", theme.INK if node.alive else theme.MUTED)
    return Content.assemble((f"{mark.mark} ", mark.color), text)


class HeaderBar(LinesPanel):
    """Header of the console."""

    def show(self, state: ConsoleState) -> None:
        """Update the line, which turns red while the robot is stopped."""
        self.set_class(state.traversal == TraversalStatus.ESTOPPED, "-stopped")
        self.show_lines([header_line(state, max(self.size.width, 40))])
