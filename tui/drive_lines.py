"""Panel lines of drives to a pose (while the operator aims, under way, and on arrival), and of guided robots."""

from __future__ import annotations

import math
from textwrap import wrap

from textual.content import Content

from touchline.schemas import topics
from touchline.schemas.messages.touchline import TraversalStatus
from touchline.schemas.plugins import POSE_METHODS, SPEED_LAWS
from touchline.tui import format, theme
from touchline.tui.goal_orders import UNANSWERED
from touchline.tui.map_raster import arrow
from touchline.tui.panel_rows import bar, row
from touchline.tui.state import ConsoleState

MESSAGE_LINES = 6
"""Maximum number of lines for the planner's message."""

FRESH_S = 2.0
"""Age from which a preview from a driving robot is marked as old."""
MOVES_ON = "preview: moves on with the robot, planned anew when sent"


def place(x_m: float, y_m: float) -> str:
    """Format a position on the field to the centimetre."""
    return f"{x_m + 0.0:.2f}, {y_m + 0.0:.2f} m"


def heading(heading_rad: float) -> str:
    """Format a heading in degrees, counter-clockwise from east, with an arrow; NaN: any."""
    if math.isnan(heading_rad):
        return "any"
    degrees = round(math.degrees(math.remainder(heading_rad, math.tau)))
    return f"{arrow(heading_rad)} {degrees}°"


def aim_hint(state: ConsoleState) -> tuple[str, str]:
    """Next step while the operator aims: (key, effect); no key if there is nothing to press."""
    draft = state.drive
    if draft.sent_id:
        return "", "sent: the robot plans the path"
    if not draft.ready:
        return ("", "the path is being planned") if draft.asked is not None else ("enter", "preview the drive")
    if draft.unseen:
        return "enter", "drive there unseen"
    return "enter", "drive on there" if draft.shown.under_way else "drive there"


def aim_lines(state: ConsoleState, width: int) -> list[Content]:
    """Goal, method and the planner's message; empty unless the operator aims."""
    draft = state.drive
    goal = draft.goal
    if goal is None:
        return []
    end = draft.path.destination if draft.path is not None else None
    chosen = f": {heading(end.heading_rad)}" if end is not None and math.isnan(goal.heading_rad) else ""
    method, law = goal.method or POSE_METHODS.default, goal.law or SPEED_LAWS.default
    within = f" in {goal.duration_s:g} s" if goal.duration_s else ""
    lines = [
        row("goal", (place(goal.x_m, goal.y_m), f"bold {theme.SKY}")),
        row("heading", (heading(goal.heading_rad), f"bold {theme.SKY}"), chosen),
        row("by", f"{method}, {law}{within}"),
    ]
    message = wrap(draft.message, width)
    if len(message) > MESSAGE_LINES:
        message = [*message[: MESSAGE_LINES - 1], f"{message[MESSAGE_LINES - 1][: width - 1]}…"]
    lines += [Content.styled(line, theme.INK if draft.path is not None else theme.ORANGE) for line in message]
    return lines + _preview_lines(state, width)


def _preview_lines(state: ConsoleState, width: int) -> list[Content]:
    """Age of the preview, if its start moves, and what keeps it from being updated."""
    draft = state.drive
    if not state.nodes[topics.PLANNER].alive:
        return [Content.styled("▲ the planner is down", f"bold {theme.ORANGE}")]
    if draft.sent_id or draft.path is None or not draft.shown.under_way:
        return []
    age_s = state.now_s - draft.shown.at_s
    if age_s <= FRESH_S:
        return [Content.styled(line, theme.MUTED) for line in wrap(MOVES_ON, width)]
    late = f"▲ preview of {age_s:.0f} s ago: {draft.trouble or UNANSWERED}"
    return [Content.styled(line, theme.ORANGE) for line in wrap(late, width)[:MESSAGE_LINES]]


def drive_lines(state: ConsoleState, status: TraversalStatus, width: int) -> list[Content]:
    """Goal and remaining distance of a drive; after arrival, the robot's estimate of its error."""
    end = state.loaded.path.destination if state.loaded.path is not None else None
    if end is None:
        return []
    name = "goal" if state.drive.goal is None else "now to"
    lines = [row(name, place(end.x_m, end.y_m), (f"  {heading(end.heading_rad)}", theme.MUTED))]
    if status.state == TraversalStatus.DONE:
        if (here := state.robot.pose) is not None:
            off_m = math.hypot(here.x_m - end.x_m, here.y_m - end.y_m)
            off_deg = abs(math.degrees(math.remainder(here.heading_rad - end.heading_rad, math.tau)))
            lines.append(row("off by", f"{format.length(off_m)}, {off_deg:.1f}°", (" estimated", theme.MUTED)))
        return [*lines, row("time", format.duration(status.elapsed_s))]
    driven = state.robot.driven_fraction
    left_m = status.total_length_m - status.arc_length_m
    return [
        *lines,
        row("driven", bar(driven, width, theme.SKY), f" {format.percent(driven):>6}"),
        row("left", format.length(left_m), (f"   {format.duration(status.remaining_s)}", theme.MUTED)),
        row("speed", format.number(status.speed_mps, 2, "m/s")),
    ]


def guided_lines(status: TraversalStatus) -> list[Content]:
    """Lines about a robot that its team's coordinator guides."""
    return [
        row("guided", "by the team's coordinator"),
        row("time", format.duration(status.elapsed_s)),
        row("speed", format.number(status.speed_mps, 2, "m/s")),
    ]
