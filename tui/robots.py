"""Robots known to the console, and the selected one, to which keys and orders apply."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from touchline.schemas import topics
from touchline.tui.event_log import INFO
from touchline.tui.fleet_layer import NO_LAYER, FleetLayer
from touchline.tui.job import NOTHING
from touchline.tui.order_registry import Phase
from touchline.tui.roll_call import RollCall, RollReply, over, replies
from touchline.tui.state import ConsoleState


@dataclass
class Robots:
    """States of all robots, by namespace, in the order of their appearance."""

    states: dict[str, ConsoleState] = field(default_factory=dict)
    selected_name: str = ""
    roll: RollCall | None = None
    """Last order to several robots."""
    layer: FleetLayer = NO_LAYER
    """Last report of the team."""
    tasks: Sequence[Mapping[str, Any]] = ()
    """Tasks of its dispatcher, as `TaskDispatcher.queue` tells them."""

    @property
    def selected(self) -> ConsoleState:
        """State of the robot in view."""
        return self.states[self.selected_name]

    @property
    def others(self) -> Mapping[str, ConsoleState]:
        """States of the other robots."""
        return {name: state for name, state in self.states.items() if name != self.selected_name}

    def add(self, name: str) -> ConsoleState:
        """Add a robot; the first one is selected."""
        state = self.states[name] = ConsoleState(name=name, closely=False)
        state.now_s = max(known.now_s for known in self.states.values())
        if not self.selected_name:
            self.selected_name = name
        self._count()
        return state

    def remove(self, name: str) -> None:
        """Remove a robot; if it was in view, another one is selected."""
        del self.states[name]
        if name == self.selected_name:
            self.selected_name = next(iter(self.states))
        self._count()

    def _count(self) -> None:
        for state in self.states.values():
            state.alone = len(self.states) == 1

    def select_next(self) -> None:
        """Select the next robot."""
        names = list(self.states)
        self.selected_name = names[(names.index(self.selected_name) + 1) % len(names)]
        if len(names) > 1:
            self.selected.orders.say(INFO, f"{self.selected_name} selected", self.selected.now_s)

    def select(self, name: str) -> None:
        """Select a robot, if it is known."""
        if name in self.states:
            self.selected_name = name

    def call_roll(self, order: str, title: str, names: Iterable[str]) -> None:
        """Begin a roll call for an order to these robots."""
        self.roll = RollCall(order, title, tuple(names), self.selected.now_s)

    def end_roll(self) -> None:
        """Close the roll call."""
        self.roll = None

    def answers(self) -> Mapping[str, RollReply]:
        """Replies to the last order to several robots; empty once all have acknowledged it for a while."""
        roll = self.roll
        if roll is None:
            return {}
        heard = replies(roll, self.states)
        return {} if over(roll, heard, self.selected.now_s) else heard

    def to_stop(self) -> tuple[str, ...]:
        """Robots that an emergency stop goes to: the selected one, present or not, and all present ones.

        Replays are left out.
        """
        there = (name for name, state in self.others.items() if state.robot_alive and not state.replayed)
        return (*(() if self.selected.replayed else (self.selected_name,)), *there)

    @property
    def stopping(self) -> bool:
        """True if a robot has not acknowledged an emergency stop."""
        return any(state.orders.stop.phase is Phase.SENT for state in self.states.values())

    @property
    def busy(self) -> tuple[str, ...]:
        """Robots on a job."""
        return tuple(name for name, state in self.states.items() if state.busy and not state.replayed)


def never_there(state: ConsoleState) -> bool:
    """True if a robot never reported and no job is prepared for it: its name was only a guess."""
    known = (state.nodes.get(name) for name in (*topics.SERVING, topics.REPLAY))
    seen = any(node is not None and node.seen for node in known)
    return not seen and state.draft is NOTHING and state.orders.stop.phase is Phase.OFF
