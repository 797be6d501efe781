"""Screen of all robots: totals, orders with their answers, map, list, and keys."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Container
from textual.content import Content
from textual.screen import Screen

from touchline.tui.fleet_list import FleetList, RobotPicked, totals_line
from touchline.tui.fleet_map import FleetMap
from touchline.tui.fleet_rows import FleetRow, fleet_rows, totals
from touchline.tui.key_bar import PressableKeys, label, place
from touchline.tui.keys import FLEET_TABLE, Bar, bar, bindings
from touchline.tui.panels import LinesPanel
from touchline.tui.robots import Robots
from touchline.tui.roll_call import roll_lines
from touchline.tui.signal_bar import SignalBar
from touchline.tui.task_queue import queue_lines

ROLL_HEIGHT = 5
QUEUE_HEIGHT = 8
LEAST_FOR_BOTH = 16
"""Number of rows from which map and list are shown together."""


class Shown(Enum):
    """Parts of the screen in view."""

    BOTH = "-both"
    LIST = "-list"
    MAP = "-map"


class FleetKeyBar(PressableKeys):
    """Keys that fit, and the name of the picked robot."""

    def show_keys(self, selected: str) -> None:
        """Redraw the parts that changed."""
        keys = [replace(key, text=f"{key.text} {selected}") if key.key == "enter" else key for key in bar(Bar.FLEET)]
        placed = place(keys, max(self.size.width, 20))
        self.show_placed(placed, Content("").join(label(key) for key, _, _ in placed))


class FleetScreen(Screen[None]):
    """Screen of all robots; keys apply to the picked one."""

    BINDINGS: ClassVar[list[BindingType]] = [*bindings(FLEET_TABLE)]

    def __init__(self, robots: Robots) -> None:
        """Create the screen for `robots`."""
        super().__init__()
        self._robots = robots
        self._by_trouble, self._shown, self._tasks_shown = True, Shown.BOTH, True
        self._rows: list[FleetRow] = []
        self._totals, self._roll, self._keys = LinesPanel(id="totals"), LinesPanel(id="roll"), FleetKeyBar()
        self._queue = LinesPanel(id="queue")
        self._signals = SignalBar(named=True)
        self._map, self._list = FleetMap(), FleetList()

    def compose(self) -> ComposeResult:
        """Lay out the parts, the most important at the top."""
        yield self._totals
        yield self._signals
        yield self._roll
        yield self._queue
        with Container(id="fleet", classes=self._shown.value):
            yield self._map
            yield self._list
        yield self._keys

    def on_mount(self) -> None:
        """Focus the list for the arrow keys."""
        self._list.focus()
        self.show()

    def on_screen_resume(self) -> None:
        """Refresh after dialogs."""
        self.show()

    def show(self) -> None:
        """Update all parts; each redraws only what changed."""
        if not self._keys.is_attached:
            return
        robots, width = self._robots, max(self.size.width, 20)
        note = "" if self._by_trouble else "by name "
        self._totals.show_lines([totals_line(totals(robots.states), width, note)])
        self._show_roll(width)
        self._show_queue(width)
        if self._shown is not Shown.LIST:
            self._map.show(robots)
        if self._shown is not Shown.MAP:
            self._rows = fleet_rows(robots, by_trouble=self._by_trouble)
        self.show_picked()

    def show_picked(self) -> None:
        """Show the picked robot; the next tick updates the rest, so that a key that is held down costs little."""
        if self._shown is not Shown.MAP:
            self._list.show(self._rows, self._robots.selected_name)
        self._keys.show_keys(self._robots.selected_name)

    def on_resize(self) -> None:
        """Show the list only, where there is no room for map and list."""
        self._arrange()

    @property
    def _low(self) -> bool:
        return self.size.height < LEAST_FOR_BOTH

    def _arrange(self) -> None:
        low = self._low and self._shown is Shown.BOTH
        self.query_one("#fleet").set_classes((Shown.LIST if low else self._shown).value)
        self.call_after_refresh(self.show)

    def _show_roll(self, width: int) -> None:
        roll, heard = self._robots.roll, self._robots.answers()
        height = min(ROLL_HEIGHT, max(self.size.height // 4, 1))
        self._roll.display = bool(roll and heard)
        if roll and heard:
            lines = roll_lines(roll, heard, width, height)
            self._roll.styles.height = len(lines)  # set before the lines, which may wrap until they are cut
            self._roll.show_lines(lines)

    def _show_queue(self, width: int) -> None:
        tasks = self._robots.tasks if self._tasks_shown else ()
        self._queue.display = bool(tasks)
        if tasks:
            lines = queue_lines(tasks, width, min(QUEUE_HEIGHT, max(self.size.height // 3, 1)))
            self._queue.styles.height = len(lines)
            self._queue.show_lines(lines)

    def on_robot_picked(self, event: RobotPicked) -> None:
        """Select the picked robot; Enter shows it alone."""
        self._robots.select(event.name)
        if event.shown:
            self.action_leave()
        else:
            self.show_picked()

    def action_leave(self) -> None:
        """Show the picked robot alone."""
        self.dismiss(None)

    def action_back(self) -> None:
        """Close the roll call, or else the screen."""
        if self._robots.answers():
            self._robots.end_roll()
            self.show()
        else:
            self.action_leave()

    def action_sort(self) -> None:
        """Toggle sorting by trouble and by name."""
        self._by_trouble = not self._by_trouble
        self.show()

    def action_shown(self) -> None:
        """Cycle through map and list, list, and map."""
        every = [each for each in Shown if each is not Shown.BOTH or not self._low]
        before = Shown.LIST if self._low and self._shown is Shown.BOTH else self._shown
        self._shown = every[(every.index(before) + 1) % len(every)]
        self._arrange()

    def action_tasks(self) -> None:
        """Show or hide the tasks of the team."""
        self._tasks_shown = not self._tasks_shown
        self.show()

    def action_fit(self) -> None:
        """Show all robots on the map."""
        self._map.fit()

    def action_follow(self) -> None:
        """Toggle keeping the picked robot in the middle of the map."""
        self._map.follow()

    def action_zoom(self, steps: int) -> None:
        """Zoom the map."""
        self._map.zoom(steps)
