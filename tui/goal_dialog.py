"""Dialog for a drive to a goal: pose method, speed law, and duration."""

from __future__ import annotations

from textual.app import ComposeResult
from textual.containers import Grid, Horizontal
from textual.widgets import Button, Label, RadioSet, Static

from touchline.schemas.messages.plan_messages import PoseGoal
from touchline.schemas.plugins import POSE_METHODS, SPEED_LAWS
from touchline.tui.dialogs import DialogBox, FormDialog, choices, number_field, pressed


class GoalDialog(FormDialog[PoseGoal | None]):
    """Choose method, law and duration; returns the goal with them."""

    NOTE = (("enter", "preview"), ("esc", "cancel"), ("tab", "next field"))

    def __init__(self, goal: PoseGoal) -> None:
        """Start from the values of the goal."""
        super().__init__()
        self._goal = goal

    def compose(self) -> ComposeResult:
        """Lay out method, law, time and buttons."""
        with DialogBox(id="dialog"):
            yield Label("How to drive there", classes="title")
            with RadioSet(id="method"):
                yield from choices(POSE_METHODS.summaries(), self._goal.method or POSE_METHODS.default)
            yield Label("Speed law")
            with RadioSet(id="law"):
                yield from choices(SPEED_LAWS.summaries(), self._goal.law or SPEED_LAWS.default)
            with Grid(id="limits"):
                value = f"{self._goal.duration_s:g}" if self._goal.duration_s else ""
                yield from number_field("duration", "takes  s", value, "as law allows")
            yield Static("", id="problem")
            with Horizontal(id="buttons"):
                yield Button("Preview", variant="primary", id="ok")
                yield Button("Cancel", id="cancel")

    def on_mount(self) -> None:
        """Focus so that Enter previews as before."""
        self.query_one("#ok").focus()

    def accept(self) -> None:
        """Return the goal."""
        problem = "takes  s: give a number above 0, or nothing for as soon as the law allows"
        duration_s = self.written_number("duration", problem)
        if duration_s is None:
            return
        chosen = {"method": pressed(self, "#method"), "law": pressed(self, "#law"), "duration_s": duration_s}
        self.dismiss(self._goal.model_copy(update=chosen))
