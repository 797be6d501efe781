"""Tasks of a team on the fleet's screen: those that need somebody first, each with its reason."""

import json

from tests.tui.fleets import fleet, fleet_console
from touchline.tui.task_queue import queue_lines, tasks_of

TASKS = [
    {"id": "done", "state": "completed", "robot": "r01", "finished_s": 30.0, "reason": "r01 has finished it"},
    {"id": "on", "state": "underway", "robot": "r02", "estimate_s": 61.0, "reason": "picks up (1 of 2)"},
    {"id": "stuck", "state": "blocked", "robot": "r03", "reason": "r03 has stood for 12 s: waits for r01"},
]


async def test_tasks_are_shown_with_reasons_and_hidden_by_a_key() -> None:
    async with fleet_console(fleet(3), "v", size=(100, 30)) as scene:
        assert "tasks:" not in scene.text()
        scene.known.queue_says.append(json.dumps({"tasks": TASKS}))
        await scene.tick()
        shown = scene.text()
        assert "3 tasks:   1 ■ blocked   1 ► underway   1 ✓ completed" in shown
        assert "waits for r01" in shown
        assert shown.index("■ stuck") < shown.index("► on") < shown.index("✓ done")
        await scene.pilot.press("k")
        await scene.tick()
        assert "tasks:" not in scene.text()


def test_lines_fit_and_what_is_no_queue_has_none() -> None:
    lines = queue_lines(tasks_of(json.dumps({"tasks": TASKS * 9})), 40, 5)
    assert len(lines) == 5
    assert all(line.cell_length <= 40 for line in lines)
    for text in ("", "[]", '{"tasks": 3}', '{"tasks": [3, {"id": 3}]}'):
        assert tasks_of(text) == []
