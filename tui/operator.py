"""Gives the operator's orders and takes in what came of them: no screen, no bus, only the state and a dispatcher."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from schemas.errors import TouchlineError
from schemas.messages.touchline import LoadRequest, PlanOptions, PlanRequest, SetSpeedRequest, TraversalStatus
from schemas.template import Template
from tui import format, orders
from tui.event_log import ERROR, INFO, WARN
from tui.orders import Order, Outcome
from tui.state import ConsoleState


class Sender(Protocol):
    """Whatever sends an order; False if one of the same name is still under way."""

    def send(self, order: Order) -> bool:
        """Send it without waiting."""
        ...


class Operator:
    """The operator's hand: every order goes out through here, and every outcome comes back here."""

    def __init__(self, state: ConsoleState, sender: Sender, say: Callable[[int, str], None], session: str) -> None:
        """`say(severity, text)` tells the operator; `session` sets this console's request ids apart from all others.

        They must differ from those of an earlier console, whose answers the services still remember.
        """
        self.state = state
        self.options = PlanOptions()
        self._sender, self._say, self._session = sender, say, session
        self._orders = 0
        self._speed_asked: float | None = None
        self._speed_wanted: float | None = None
        """Until the answer about the one asked for is here."""

    # -- orders ------------------------------------------------------------------------------------------------------

    def command(self, name: str) -> None:
        """An order without arguments, by its name in `orders.COMMANDS`."""
        self._send(orders.command(name, self._request_id()))

    def pause_or_resume(self) -> None:
        """Pause, or resume if paused."""
        self.command("resume" if self.state.traversal == TraversalStatus.PAUSED else "pause")

    def choose(self, template: Template, text: str) -> None:
        """Take a template into view."""
        self.state.choose_template(template, text)
        size = f"{len(template.segments)} lines, {format.length(template.length_m)} of paint"
        self.state.note(INFO, "console", f"Template {template.name}: {size}")

    def may_prepare(self, what: str, *, needs_template: bool) -> bool:
        """Whether a new job may be prepared now; says why not."""
        if self.state.busy:
            self._say(WARN, f"{what}: the robot is on a job; wait for its end or abort it first")
        elif needs_template and self.state.template is None:
            self._say(WARN, f"{what}: choose a template first (t)")
        else:
            return True
        return False

    def plan(self, options: PlanOptions) -> None:
        """Plan the template in view."""
        if self.state.template is None:
            return
        self.options = options
        order = orders.plan(self.state.template.text, options, self._request_id())
        if self._send(order):
            self.state.plan_request = order.request_id

    def load(self, *, resume: bool = False) -> None:
        """Hand the plan to the robot; with `resume`, to go on where it was in it when its process died."""
        if self.state.path is None or self.state.template is None:
            self._say(WARN, "Load: plan a template first (p)")
            return
        self._send(orders.load(self.state.path.trajectory, self.state.template.text, self._request_id(), resume=resume))

    def set_speed(self, factor: float) -> None:
        """Let simulated time pass at a factor of real time; if another is still being set, then after that."""
        if self._sender.send(orders.set_speed(factor, self._request_id())):
            self._speed_asked = factor
        else:
            self._speed_wanted = factor

    def change_speed(self, steps: int) -> None:
        """The next faster or slower factor than the one asked for last, so that no key press is lost."""
        latest = (self._speed_wanted, self._speed_asked, self.state.speed_factor)
        self.set_speed(orders.next_speed(next((speed for speed in latest if speed is not None), None), steps))

    def _request_id(self) -> str:
        self._orders += 1
        return f"tui-{self._session}-{self._orders}"

    def _send(self, order: Order) -> bool:
        sent = self._sender.send(order)
        if not sent:
            self._say(INFO, f"{order.title}: still waiting for the answer to the last one")
        return sent

    # -- outcomes ----------------------------------------------------------------------------------------------------

    def done(self, outcome: Outcome) -> bool:
        """Take in what came of an order and say so; False if it was not carried out or its answer makes no sense."""
        title = outcome.order.title
        if isinstance(outcome.order.request, SetSpeedRequest):
            wanted, self._speed_asked, self._speed_wanted = self._speed_wanted, None, None
            if outcome.ok and wanted is not None:
                self.set_speed(wanted)
        if isinstance(outcome.order.request, PlanRequest):
            self.state.plan_done(outcome.order.request_id)
        if not outcome.ok:
            self._say(ERROR, f"{title} {'failed' if outcome.failure else 'refused'}: {outcome.reason}")
            return False
        try:
            text = self._take_over(outcome)
        except (TouchlineError, ValueError) as error:
            self._say(ERROR, f"{title}: the answer is of no use: {error}")
            return False
        self._say(WARN if outcome.order.name in ("estop", "abort") else INFO, f"{title}: {text or 'done'}")
        return True

    def _take_over(self, outcome: Outcome) -> str:
        """Change the state as the order did the world; what to say about it."""
        request, response = outcome.order.request, outcome.response
        if isinstance(request, PlanRequest):
            if self.state.busy:
                raise TouchlineError("the robot has begun another job meanwhile")
            if self.state.template is None or request.template_json != self.state.template.text:
                raise TouchlineError("another template has been chosen meanwhile")
            self.state.planned(response.trajectory, response.report)
            report = response.report
            return f"{format.length(report.total_length_m)} in {format.duration(report.total_time_s)}"
        if isinstance(request, LoadRequest):
            self.state.handed_over()
            return f"takes {format.duration(response.total_time)}"
        if isinstance(request, SetSpeedRequest):
            self.state.speed_set(request.factor)
            return format.factor(request.factor)
        return outcome.reason
