"""Panel with the tasks of a team's dispatcher."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, Final

from textual.content import Content

from touchline.tui import format, theme

MARKS: Final[Mapping[str, theme.Badge]] = {
    "blocked": theme.Badge("■", "blocked", theme.VERMILION),
    "failed": theme.Badge("✗", "failed", theme.VERMILION),
    "failed_to_assign": theme.Badge("✗", "failed to assign", theme.VERMILION),
    "delayed": theme.Badge("▲", "delayed", theme.ORANGE),
    "underway": theme.Badge("►", "underway", theme.GREEN),
    "dispatched": theme.Badge("…", "dispatched", theme.INK),
    "selected": theme.Badge("…", "selected", theme.MUTED),
    "queued": theme.Badge("…", "queued", theme.MUTED),
    "killed": theme.Badge("✗", "killed", theme.MUTED),
    "canceled": theme.Badge("✗", "canceled", theme.MUTED),
    "completed": theme.Badge("✓", "completed", theme.GREEN),
}
"""Marks by state, those first that need somebody's attention."""
_ORDER: Final = {state: number for number, state in enumerate(MARKS)}
_UNKNOWN: Final = theme.Badge("?", "unknown", theme.ORANGE)


def tasks_of(text: str) -> list[Mapping[str, Any]]:
    """Return the tasks of a queue in JSON; none if it is not one."""
    try:
        tasks = json.loads(text)["tasks"]
        return [each for each in tasks if isinstance(each, dict) and isinstance(each.get("id"), str)]
    except (ValueError, TypeError, KeyError):
        return []


def queue_lines(tasks: Sequence[Mapping[str, Any]], width: int, height: int) -> list[Content]:
    """Render the numbers of tasks by state, then tasks that need attention first, at most `height` lines."""
    counts = Counter(str(each.get("state")) for each in tasks)
    parts = [
        (f"   {counts[state]} {badge.mark} {badge.text}", badge.color)
        for state, badge in MARKS.items()
        if counts[state]
    ]
    lines = [Content.assemble((f" {len(tasks)} tasks:", f"bold {theme.INK}"), *parts).truncate(width, ellipsis=True)]
    shown = sorted(tasks, key=lambda each: _ORDER.get(str(each.get("state")), -1))
    return lines + [_task_line(each, width) for each in shown[: height - 1]]


def _task_line(task: Mapping[str, Any], width: int) -> Content:
    badge = MARKS.get(str(task.get("state")), _UNKNOWN)
    ends_s = task.get("finished_s") or task.get("estimate_s")
    until = format.duration(ends_s) if isinstance(ends_s, int | float) else ""
    parts = [
        (f" {badge.mark} {format.cut(str(task['id']), 12):<12}", f"bold {badge.color}"),
        (f" {format.cut(str(task.get('robot') or '–'), 8):<8} {until:>7}", theme.INK),
        (f"  {task.get('reason', '')}", theme.MUTED),
    ]
    return Content.assemble(*parts).truncate(width, ellipsis=True)
