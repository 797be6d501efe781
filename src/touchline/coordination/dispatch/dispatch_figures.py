"""Figures of a dispatcher's queue, for reports."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any, Final

from touchline.coordination.dispatch.dispatcher import BY_ITSELF

_GOOD: Final = ("completed", "canceled")


def dispatch_figures(queue: Mapping[str, Any]) -> dict[str, Any]:
    """Return a queue with figures of all tasks together.

    Args:
        queue: JSON object, as of `TaskDispatcher.queue`.
    """
    tasks, robots = queue["tasks"], queue["robots"]
    ended = [each["finished_s"] for each in tasks if each["state"] == "completed"]
    late = [each["late_s"] for each in tasks if each["late_s"] > 0.0]
    return {
        "states": dict(sorted(Counter(each["state"] for each in tasks).items())),
        "makespan_s": max(ended, default=None),
        "late": len(late),
        "late_most_s": max(late, default=0.0),
        "driven_m": round(sum(each["driven_m"] for each in robots.values()), 3),
        "used_wh": round(sum(each["used_wh"] for each in robots.values()), 3),
        "charged_wh": round(sum(each["charged_wh"] for each in robots.values()), 3),
        "stands_most_s": max((each["until_s"] - each["from_s"] for each in queue["stands"]), default=0.0),
        **queue,
    }


def why_not_dispatched(queue: Mapping[str, Any]) -> str:
    """Return why a queue is no success: tasks that are neither completed nor canceled; "" if there are none."""
    lacking = [each for each in queue["tasks"] if each["state"] not in _GOOD and each["labels"] != list(BY_ITSELF)]
    if not lacking:
        return ""
    first = lacking[0]
    return f"{len(lacking)} tasks are not completed, first {first['id']}, {first['state']}: {first['reason']}"
