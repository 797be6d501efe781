"""Desks: link, state and operator of each robot; what comes in goes to the states, and orders go out."""

from __future__ import annotations

import math
import secrets
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from touchline.tui.dispatch import Dispatcher
from touchline.tui.fleet_layer import NO_LAYER, layer_of
from touchline.tui.fleet_raster import claims_of
from touchline.tui.operator import Operator
from touchline.tui.orders import OrderOutcome, Tried
from touchline.tui.protocol import Link, Links
from touchline.tui.reduction import apply_event
from touchline.tui.robots import Robots, never_there
from touchline.tui.state import ConsoleState
from touchline.tui.task_queue import tasks_of

PAINT_RETRY_S = 1.0
TEAM_STALE_S = 3.0
"""Age from which cells without an update are not drawn any more."""
STOP_HOLDS_S = 3.0
"""Time after an emergency stop within which a robot that is found is stopped, too."""
REST_S = 0.2
"""Time after which a robot in view is followed closely: keys that are held down pass many by."""
LONGEST_TICK_S = 0.25
"""Maximum time that passes for the console between two ticks: its own absence makes nobody else silent."""


@dataclass
class Desk:
    """Link, state and operator of one robot.

    Attributes:
        link: Link to the robot.
        state: State of the robot.
        operator: Sender of orders to it.
        wanted_closely: Whether all of its topics are wanted though it is out of view.
        paint_due_s: Time from which all of its paint may be requested again.
    """

    link: Link
    state: ConsoleState
    operator: Operator
    wanted_closely: Callable[[], bool] = lambda: False
    paint_due_s: float = 0.0


class Desks:
    """Desks of all robots that have been found."""

    def __init__(
        self, links: Links, clock: Callable[[], float], post_news: Callable[[str, Tried | OrderOutcome], None]
    ) -> None:
        """Open a desk for each robot of `links`; `post_news(robot, news)` is called from the orders' threads."""
        self.robots = Robots()
        self._links, self._clock, self._post_news = links, clock, post_news
        self._desks: dict[str, Desk] = {}
        self._ticked_s = clock()
        self._stopped_at_s = self._team_heard_s = -math.inf
        self._take_up_robots()
        self._in_view, self._in_view_since_s = self.robots.selected_name, -math.inf

    @property
    def selected(self) -> Desk:
        """Desk of the robot in view."""
        return self._desks[self.robots.selected_name]

    def find(self, name: str) -> Desk | None:
        """Desk of a robot; None if it was only a guess."""
        return self._desks.get(name)

    def stop(self) -> tuple[str, ...]:
        """Stop all robots, from any thread, and return their names."""
        self._stopped_at_s = self._clock()
        names = self.robots.to_stop()
        operators = [self._desks[name].operator for name in names]
        for operator in operators:  # all within milliseconds: what repeats it takes a thread for each
            operator.post_stop()
        for operator in operators:
            operator.stop()
        return names

    def tick(self, start: Callable[[Operator], None]) -> None:
        """Take what came in, and send due orders.

        Args:
            start: Starts the rest of a job that has been loaded.
        """
        now, since = self._clock(), self._ticked_s
        self._ticked_s = now
        self._take_up_robots()
        self._attend(now)
        for desk in self._desks.values():
            state = desk.state
            state.now_s += min(max(now - since, 0.0), LONGEST_TICK_S)
            run = state.replay.run
            for event in desk.link.poll():
                apply_event(state, event, state.now_s)
            if state.replay.run != run:
                desk.paint_due_s = now
            desk.operator.heed_status()
            desk.operator.goals.refresh()
            if desk.operator.start_due:
                start(desk.operator)
            if state.closely and state.paint.needs_fetch and state.robot_alive and now >= desk.paint_due_s:
                desk.paint_due_s = now + PAINT_RETRY_S
                state.paint.fetch_asked()
                desk.link.fetch_paint()
        self.robots.layer = self.robots.layer.claiming(claims_of(self.robots))

    def _take_up_robots(self) -> None:
        """Create a desk for each robot that is found; a robot that was only a guess is dropped.

        A robot that is found while the others are being stopped is stopped, too, as the key is meant for all.
        """
        self._draw_team()
        found = self._links.found()
        guesses = [name for name, desk in self._desks.items() if never_there(desk.state)] if found else []
        for name, link in found:
            state = self.robots.add(name)
            operator = Operator(state, Dispatcher(link, partial(self._post_news, name)), secrets.token_hex(4))
            self._desks[name] = Desk(link, state, operator)
            if self.robots.stopping or self._clock() - self._stopped_at_s < STOP_HOLDS_S:
                operator.stop()
        for name in guesses:
            self.robots.remove(name)
            del self._desks[name]

    def _draw_team(self) -> None:
        """Draw the cells that a coordinator reports, as long as it does, and its tasks."""
        if (queue := self._links.queue()) is not None:
            self.robots.tasks = tasks_of(queue)
        if (team := self._links.team()) is not None:
            self.robots.layer, self._team_heard_s = layer_of(team), self._clock()
        elif self.robots.layer.cells and self._clock() - self._team_heard_s > TEAM_STALE_S:
            self.robots.layer, self.robots.tasks = NO_LAYER, ()

    def _attend(self, now: float) -> None:
        """Listen closely to the robot in view and to those with orders under way; to others only for their state."""
        if self.robots.selected_name != self._in_view:
            self._in_view, self._in_view_since_s = self.robots.selected_name, now
        rests = now - self._in_view_since_s >= REST_S
        for name, desk in self._desks.items():
            closely = desk.wanted_closely() or desk.state.drive.goal is not None
            closely |= name == self._in_view and (rests or desk.state.closely)
            if closely != desk.state.closely:
                desk.link.attend(closely=closely)
                desk.state.attend(closely=closely)
