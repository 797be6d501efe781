"""Lines about things in the robot's way, and what it does about them."""

from __future__ import annotations

import math
from textwrap import wrap

from textual.content import Content

from touchline.schemas.messages.way_round_messages import WayRound
from touchline.schemas.plain_text import plain
from touchline.tui import format, theme
from touchline.tui.panel_rows import row
from touchline.tui.state import ConsoleState
from touchline.tui.waiting_robot import asks_way, blocked, goes_round_in_s

ANSWER_KEYS = "1 wait on, 2 go round, 3 leave out"


def what_ends_it(state: ConsoleState) -> str:
    """End of a wait before something, without a person."""
    if state.robot.way_round.state == WayRound.PLANS:
        return "plans a way round"
    if (in_s := goes_round_in_s(state)) is not None:
        does = "searches again" if state.robot.way_round.state == WayRound.FINDS_NO_WAY else "goes round"
        return f"{does} in {math.ceil(in_s)} s"
    return "goes on once its way is clear"


def left_out(told: WayRound) -> list[str]:
    """Outlines beside which something of the job is left out."""
    return [*(each.outline for each in told.left_out), *(each.outline for each in told.left_out_patches)]


def way_round_lines(state: ConsoleState, width: int) -> list[Content]:
    """Things in the way, the answers that the robot can be given, and what of the job is left out."""
    told, lines = state.robot.way_round, list[Content]()
    if told.things and state.busy:
        named = format.cut(", ".join(told.things), width - 10)
        lines.append(row("before" if blocked(state) else "round", named))
    if blocked(state) and told.state == WayRound.FINDS_NO_WAY:
        lines.append(Content.styled("▲ finds no way round", f"bold {theme.ORANGE}"))
    if asks_way(state) and not state.replayed:
        unless = "unless told: " if goes_round_in_s(state) is not None else ""
        lines += [Content.styled(line, theme.INK) for line in wrap(f"{unless}{ANSWER_KEYS}", width)]
    if outlines := left_out(told):
        beside = ", ".join(dict.fromkeys(plain(name) for name in outlines if name))
        length_m = sum(each.length_m for each in told.left_out)
        size_m2 = sum(each.size_m2 for each in told.left_out_patches)
        shown = format.length(length_m) if told.left_out else format.number(size_m2, 1, "m²")
        beside = format.cut(f"  {beside}", width - 9 - len(shown)) if beside else ""
        lines.append(row("left out", (shown, theme.ORANGE), (beside, theme.MUTED)))
    if told.drives > 1:  # else it seems that earlier paint has been lost, or that the whole job is complete
        lines.append(row("figures", f"of drive {told.drives} alone"))
    return lines
