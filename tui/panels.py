"""Side panels: state of job, robot and services."""

from __future__ import annotations

import math
from dataclasses import replace
from textwrap import wrap

from textual.content import Content
from textual.widgets import Static

from touchline.schemas import topics
from touchline.schemas.messages.coverage_messages import AreaReport
from touchline.schemas.messages.touchline import GnssStatus, TraversalStatus
from touchline.schemas.plain_text import plain
from touchline.schemas.supplies import times
from touchline.tui import format, supply_check, theme
from touchline.tui.alerts import LOW_BATTERY, is_over, remedy
from touchline.tui.drive_lines import aim_hint, aim_lines, drive_lines, guided_lines
from touchline.tui.node_health import STARTING, Freshness, silence
from touchline.tui.order_registry import Phase
from touchline.tui.panel_rows import bar as _bar
from touchline.tui.panel_rows import row as _row
from touchline.tui.state import ConsoleState
from touchline.tui.unfinished_job import name_of, next_step, offered, share_done
from touchline.tui.waiting_robot import blocked
from touchline.tui.way_round_lines import left_out, way_round_lines, what_ends_it

LOW_PAINT = 0.15
GOOD_ERROR_M = 0.02
"""Lateral error within the promised accuracy."""

ROOMY = 38
"""Width from which less urgent figures are shown, too."""

PEOPLE = (topics.CONSOLE, topics.OPERATOR, topics.OBSERVER)
"""Nodes of people, this console among them."""
NODE_LABELS = {topics.ROBOT_SIM: "robot"}


def badge(state: ConsoleState) -> theme.Badge:
    """Badge of the traversal's state; a silent robot may be in another state by now."""
    if not state.robot_alive:
        return theme.NO_ROBOT
    if state.traversal is None:
        return theme.STARTING if state.robot_freshness is Freshness.STARTING else theme.WAITING
    known = theme.STATES[state.traversal]
    if state.replayed and state.replay.paused:
        return theme.REPLAY_PAUSED
    if state.replayed:
        known = replace(known, text=f"REPLAY {known.text}")
    if not state.robot_stale:
        return known
    return theme.Badge(known.mark, f"{known.text}? silent for {state.robot_silence_s:.0f} s", theme.ORANGE)


def hint(state: ConsoleState) -> tuple[str, str]:
    """Next step: (key, effect); the key is empty if there is nothing to press."""
    traversal = state.traversal
    if state.replayed:
        return "space", "pause the replay" if state.replay.playing else "go on with the replay"
    if state.orders.stop.phase is Phase.SENT and (state.robot_stale or not state.robot_alive):
        return "", "use the robot's stop button"
    if state.robot_stale and state.busy:
        return "e", "stop; keep clear of the robot"
    if traversal == TraversalStatus.ESTOPPED:
        return "r", "reset, once it is safe"
    if (moves_off_in_s := state.moves_off_in_s) is not None:
        return "space", f"hold: {_moves_off(state, moves_off_in_s)}"
    if traversal == TraversalStatus.PAUSED:
        return remedy(state) or ("g", "resume")
    if state.robot.way_round.continues and traversal in (TraversalStatus.DONE, TraversalStatus.ABORTED):
        return "", "the job goes on: the robot plans the rest"
    if state.drive.goal is not None:
        return aim_hint(state)
    if traversal == TraversalStatus.RUNNING:
        return "space", "pause"
    if (job := next_step(state)) is not None:
        return "g", f"go on: {share_done(state, job)}"
    if traversal == TraversalStatus.ABORTED:
        return "r", "reset"
    if state.progress is not None:
        return "", f"planning: {state.progress.stage} {format.percent(state.progress.fraction)}"
    if state.job.drives and state.path_loaded:
        return ("d", "next goal") if traversal == TraversalStatus.DONE else ("s", "start driving")
    if state.template is None:
        return "t", "choose a template"
    if state.path is None:
        return "p", "plan the path"
    if not state.robot_alive:
        return "", "waiting for the robot"
    if traversal == TraversalStatus.DONE:
        return "t", "next template"
    if not state.path_loaded:
        return "l", "load the plan"
    return "s", "start covering" if state.covers else "start painting"


def _moves_off(state: ConsoleState, in_s: float) -> str:
    """Time until the robot moves off by itself: exact if it warns, else the earliest, or the event it waits for."""
    seconds = math.ceil(in_s)
    if state.robot.warning.active:
        return f"moves off in {seconds} s"
    return what_ends_it(state) if blocked(state) else f"goes on in ≥ {seconds} s"


def status_lines(state: ConsoleState, width: int) -> list[Content]:
    """Lines of the status panel, `width` cells wide."""
    shown, status = badge(state), state.robot.status if state.robot_alive else None
    head = [Content.styled(f" {shown.mark} {shown.text} ".center(width), f"bold {shown.on} on {shown.color}")]
    if shown is theme.REPLAY_PAUSED and state.traversal is not None:
        head.append(Content.styled(f"recorded: {theme.STATES[state.traversal].text}", theme.MUTED))
    head += [Content.styled(line, theme.ORANGE) for line in (*_starting(state, width), *_reasons(state, width))]
    key, text = hint(state)
    head += _step(key, text, width, "reverse bold")
    head += way_round_lines(state, width) if status is not None else []
    head += _unfinished_lines(state, width) + aim_lines(state, width)
    if state.drive.goal is not None and not state.busy:
        lines = []
    elif status is None or status.state in (TraversalStatus.IDLE, TraversalStatus.READY):
        lines = _plan_lines(state)
    elif state.guided:
        lines = guided_lines(status)
    elif state.loaded.drives:
        lines = drive_lines(state, status, width)
    else:
        lines = _job_lines(state, status, width)
    if not state.robot_alive:
        supervisor = state.nodes.get(topics.SUPERVISOR)
        started_again = supervisor is not None and supervisor.alive
        return [*head, *lines, *([] if started_again else [Content.styled("touchline up  starts one", theme.MUTED)])]
    lines += _robot_lines(state, width) + _report_lines(state)
    if state.robot_stale:  # these figures are old
        lines = [Content.styled(line.plain, theme.MUTED) for line in lines]
    return head + lines


def _unfinished_lines(state: ConsoleState, width: int) -> list[Content]:
    """Lines about an unfinished job: its name, the reason of its end, and the alternatives."""
    job = offered(state)
    if job is None or state.traversal == TraversalStatus.READY or state.robot.way_round.continues:
        return []
    again = ("l", "the whole job anew") if state.path is not None else ("t", "another job, or this anew")
    lines = []
    if next_step(state) is None:
        lines += _step("g", f"go on with {name_of(job)}: {share_done(state, job)}", width)
    elif state.traversal != TraversalStatus.ABORTED:
        lines += _step(*again, width)
        lines.append(_row("job", format.cut(name_of(job), width - 10)))
        lines += [Content.styled(line, theme.MUTED) for line in wrap(job.reason, width)[:2]]
    else:
        lines += _step("r", "reset, to do another job", width)
    return lines


def _step(key: str, text: str, width: int, style: str = f"bold {theme.SKY}") -> list[Content]:
    """Lines about a key and its effect, as many as needed, so that a key in the text is never cut off."""
    mark = f" {key} " if key else ""
    first, *rest = wrap(text, width - len(mark) - 1)
    lines = [Content.assemble((mark, style), (f" {first}", theme.INK))]
    return lines + [Content.styled(f"{' ' * len(mark)} {line}", theme.INK) for line in rest]


def _starting(state: ConsoleState, width: int) -> list[str]:
    """Progress of robot and planner while they start."""
    lines = []
    for name in (topics.ROBOT_SIM, topics.PLANNER):
        node = state.nodes.get(name)
        if node is not None and node.message and node.freshness(state.now_s) is Freshness.STARTING:
            # The piece within a stage changes too often to be read.
            stage, ends, _ = node.message.removeprefix(STARTING).partition("): ")
            lines.append(format.cut_end(f"{NODE_LABELS.get(name, name)}: {stage}{ends[:1]}", width))
    return lines


def _reasons(state: ConsoleState, width: int) -> list[str]:
    """Reason of the robot's state, and the reason of its first stop, if that differs."""
    status = state.robot.status if state.robot_alive else None
    if status is None or not status.reason:
        return []
    reason, first = status.reason, state.robot.stopped_by
    lines = [] if is_over(state, reason) else wrap(reason, width)[:3]
    if first in ("", reason) or is_over(state, first) or state.moves_off_in_s is not None:
        return lines
    return [*lines, *wrap(f"stopped first: {first}", width)[:2]]


def _job_lines(state: ConsoleState, status: TraversalStatus, width: int) -> list[Content]:
    name, here = _line_name(state, status)
    name = format.cut(name, width - 10 - len(here))
    coverage, driven = status.coverage_pct / 100, state.robot.driven_fraction
    left = f"   {format.duration(status.remaining_s)} left" if state.busy else ""
    speed = format.number(status.speed_mps, 2, "m/s")
    return [
        _row("swath" if state.covers else "line", name, (f" {here}", theme.MUTED)),
        _row("driven", _bar(driven, width, theme.SKY), f" {format.percent(driven):>6}"),
        _row("covered", _bar(coverage, width, theme.WHITE), f" {format.percent(coverage, 1):>7}"),
        _row("time", format.duration(status.elapsed_s), (left, theme.MUTED)),
        _row("speed", f"{speed:<10}", _lateral(status) if state.busy else ""),
        *_steering_lines(state),
        *_truth_lines(state, width),
    ]


def _line_name(state: ConsoleState, status: TraversalStatus) -> tuple[str, str]:
    """Current line and its number: (label, number/count)."""
    path = state.path
    if path is None or status.segment_index >= len(path.goals):
        return plain(status.segment_id) or format.UNKNOWN, f"{status.segment_index + 1}/{status.segment_count}"
    goal = path.goals[status.segment_index]
    if goal >= len(path.rows):
        return "to the end", f"{len(path.rows)}/{len(path.rows)}"
    label = path.rows[goal].label
    return f"to {label}" if path.transition[status.segment_index] else label, f"{goal + 1}/{len(path.rows)}"


def _truth_lines(state: ConsoleState, width: int) -> list[Content]:
    """Figures that only an emulator knows; those above are the robot's own."""
    truth, area = state.robot.truth, state.robot.area
    if state.covers and area is not None:
        twice = f", {format.number(area.overlap_m2, 0, 'm²')} twice" if width >= ROOMY else ""
        return [_row("truth", format.percent(area.coverage_pct / 100, 2) + " covered", (twice, theme.MUTED))]
    if truth is None:
        return []
    error = truth.lateral_error_m if state.busy else math.nan
    return [
        _row(
            "truth",
            format.percent(truth.coverage_pct / 100, 1) + (" covered" if width >= ROOMY else ""),
            (f", {abs(error) * 1000:.0f} mm off{_error_mark(error)}", _error_color(error))
            if math.isfinite(error)
            else "",
        )
    ]


def _steering_lines(state: ConsoleState) -> list[Content]:
    """Angle of a steered wheel, if there is one."""
    motion = state.robot.motion
    angle_rad = state.vehicle.drive.steering_rad(*motion) if motion is not None else None
    if angle_rad is None:
        return []
    degrees = round(math.degrees(angle_rad), 1)
    side = ("◂ ", "left") if degrees > 0 else ("▸ ", "right") if degrees < 0 else ("", "straight ahead")
    text = f"{side[0]}{abs(degrees):.1f}° {side[1]}" if degrees else side[1]
    return [_row("steering", text)]


def _error_mark(error_m: float) -> str:
    return "" if abs(error_m) <= GOOD_ERROR_M else " ▲"


def _error_color(error_m: float) -> str:
    return theme.INK if abs(error_m) <= GOOD_ERROR_M else theme.ORANGE


def _lateral(status: TraversalStatus) -> Content:
    error = status.lateral_error_m
    if not math.isfinite(error):
        return Content("")
    return Content.assemble(
        ("error ", theme.MUTED),
        (f"{error * 1000:+.0f} mm{_error_mark(error)}", _error_color(error)),
    )


def _plan_lines(state: ConsoleState) -> list[Content]:
    lines = []
    if state.template:
        lines.append(_row("template", plain(state.template.template.name)))
    report = state.path.report if state.path else None
    if report:
        # The plan's figure is the length of the axle's path, which on arcs differs from the line's.
        drawn = state.template.template if state.template else None
        painted_m = drawn.length_m if drawn and not drawn.areas else report.paint_length_m
        lines += [
            _row(
                "cover" if state.covers else "paint",
                f"{format.length(painted_m)}",
                (f" in {report.painted_segments} {state.worked_along}", theme.MUTED),
            ),
            _row("driving", f"{format.length(report.transition_length_m)}", (" between them", theme.MUTED)),
            _row("takes", format.duration(report.total_time_s)),
        ]
    return lines + _needs_lines(state)


def _needs_lines(state: ConsoleState) -> list[Content]:
    """Supplies that the job needs, compared with what the robot has."""
    needs, report = supply_check.of_job(state), state.path.report if state.path else None
    lines: list[Content] = []
    for supply, thing, unit, digits, verb in (
        (needs.paint, "tank", "L", 1, "refill"),
        (needs.battery, "battery", "Wh", 0, "change"),
    ):
        if supply.needed is None:
            continue
        color = theme.INK if supply.lasts else theme.ORANGE
        text = format.number(supply.needed, digits, unit)
        if supply.there is not None:
            text += f", {thing} {format.number(supply.there, digits, unit)}"
        lines.append(_row("" if lines else "needs", (text, color)))
        if not supply.lasts:
            lines.append(_row("", (f"▲ {verb} {times(supply.refills)}", f"bold {color}")))
    if report:
        crossings = f"{report.wet_crossings} times" if report.wet_crossings else "no"
        lines.append(_row("crosses", crossings, (" wet paint", theme.MUTED)))
    return lines


def _robot_lines(state: ConsoleState, width: int) -> list[Content]:
    robot, lines = state.robot, []
    if robot.gnss:
        fix = theme.FIXES[robot.gnss.fix]
        accuracy = format.length(robot.gnss.horizontal_accuracy_m)
        extra = "" if robot.gnss.fix == GnssStatus.NONE else f"  ±{accuracy}"
        if extra and width >= ROOMY:
            extra += f"  {robot.gnss.satellites} satellites"
        lines.append(_row("fix", (f"{fix.mark} {fix.text}", fix.color), (extra, theme.MUTED)))
    if robot.spread is not None:
        axes = f"{format.length(robot.spread.long_m)} × {format.length(robot.spread.short_m)}"
        lines.append(_row("within", axes, (" (3σ)", theme.MUTED)))
    if robot.battery:
        charge = robot.battery.percentage
        color = theme.GREEN if charge > LOW_BATTERY else theme.VERMILION
        lines.append(_row("battery", _bar(charge, width, color), f" {format.percent(charge):>6}"))
    if robot.sprayer and state.vehicle.tool.paints:
        tank = robot.sprayer.tank_l
        share = tank / state.vehicle.tool.capacity_l
        color = theme.WHITE if share > LOW_PAINT else theme.VERMILION
        lines.append(_row("paint", _bar(share, width, color), f" {format.number(tank, 1, 'L'):>7}"))
        valve = ("● open", theme.YELLOW) if robot.sprayer.valve_open else ("○ shut", theme.MUTED)
        disc = "down" if robot.sprayer.disc_down else "up"
        lines.append(_row("valve", valve, ("   discs ", theme.MUTED), disc))
    return lines


def _report_lines(state: ConsoleState) -> list[Content]:
    report = state.robot.report
    if not report or state.loaded.drives or state.traversal not in (TraversalStatus.DONE, TraversalStatus.ABORTED):
        return []
    if state.robot.way_round.continues:  # it is of one drive of several
        return []
    if report.success and left_out(state.robot.way_round):
        verdict = ("▲ with parts left out", theme.ORANGE)
    elif report.success:
        verdict = ("✓ complete", theme.GREEN)
    elif state.traversal == TraversalStatus.DONE:
        verdict = ("✗ not as the template asks", theme.ORANGE)
    else:
        verdict = ("✗ incomplete", theme.ORANGE)
    if state.covers and (area := state.robot.area_report) is not None:
        return [_row("result", verdict), *_area_report_lines(area)]
    gaps = (f"  gaps {format.length(report.gap_m)}", theme.MUTED)
    within = f"  within {format.length(report.tolerance_m)} {format.percent(report.within_tolerance_pct / 100, 2)}"
    return [
        _row("result", verdict),
        _row("length", format.percent(report.coverage_pct / 100, 2), (within, theme.MUTED)),
        _row("area", format.percent(report.area_coverage_pct / 100, 2)),
        _row("accuracy", f"95 % within {format.length(report.lateral_error_p95_m)}"),
        _row("excess", format.number(report.overspray_m2, 2, "m²"), gaps),
    ]


def _area_report_lines(area: AreaReport) -> list[Content]:
    reachable = f"  {format.percent(area.of_reachable_pct / 100, 2)} of reachable"
    patches = f"  {len(area.missed)} patches"
    return [
        _row("field", format.percent(area.coverage_pct / 100, 2), (reachable, theme.MUTED)),
        _row("plan", format.percent(area.of_planned_pct / 100, 2)),
        _row("missed", format.number(area.missed_m2, 1, "m²"), (patches, theme.MUTED)),
        _row("twice", format.number(area.overlap_m2, 0, "m²")),
        _row("outside", format.length(area.body_outside_m), ("  the body, at most", theme.MUTED)),
        _row("accuracy", f"95 % within {format.length(area.lateral_error_p95_m)}"),
    ]


def service_lines(state: ConsoleState, width: int) -> list[Content]:
    """Lines of the processes, and one of the bus."""
    lines = []
    for node in state.nodes.values():
        if node.name in PEOPLE:
            continue
        freshness = node.freshness(state.now_s)
        mark, color = theme.FRESHNESS[freshness].mark, theme.FRESHNESS[freshness].color
        if freshness is Freshness.STALE:
            text = silence(node.silence_s(state.now_s))
        elif freshness is Freshness.STARTING:
            text = format.cut_end(node.message, width - 13) or f"no report yet for {node.silence_s(state.now_s):.0f} s"
        elif freshness is Freshness.LIVE:
            message = "" if is_over(state, node.message) else node.message
            text, color = message or "alive", theme.GREEN if node.level == 0 else theme.ORANGE
        else:
            text, color = ("down", color) if node.seen else ("not seen", theme.MUTED)
        name = NODE_LABELS.get(node.name, node.name)
        text_color = theme.MUTED if color == theme.GREEN else color
        lines.append(Content.assemble((f"{mark} ", color), f"{name:<11}", (format.cut(text, width - 13), text_color)))
    color = theme.MUTED if not state.lost and not state.rejected else theme.ORANGE
    lines.append(Content.styled(f"bus: {state.lost} lost, {state.rejected} unreadable", color))
    return lines


class LinesPanel(Static):
    """Panel of lines that is redrawn only when they changed."""

    _shown: Content | None = None

    def __init__(self, title: str = "", *, id: str | None = None) -> None:
        """Create an empty panel."""
        super().__init__(id=id)
        self.border_title = title
        self._height = 0

    def show_lines(self, lines: list[Content]) -> None:
        """Show lines."""
        content = Content("\n").join(lines)
        if self._shown is None or not content.is_same(self._shown):
            self._shown = content
            # No line is wrapped, so the layout depends only on their number.
            self.update(content, layout=len(lines) != self._height)
            self._height = len(lines)


class StatusPanel(LinesPanel):
    """Panel of the states of job and robot."""

    def show(self, state: ConsoleState) -> None:
        """Redraw the parts that changed."""
        self.border_title = "Status" if state.alone else f"Status of {state.name}"
        self.show_lines(status_lines(state, max(self.content_size.width, 20)))


class ServicesPanel(LinesPanel):
    """Panel of the processes."""

    def show(self, state: ConsoleState) -> None:
        """Redraw the parts that changed."""
        self.show_lines(service_lines(state, max(self.content_size.width, 20)))
