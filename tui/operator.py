"""Operator: sends orders to a robot and processes their outcomes, using only state and dispatcher."""

from __future__ import annotations

import math
import threading
import time
from itertools import count
from typing import Protocol

from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages.plan_messages import PlanOptions, PlanRequest
from touchline.schemas.messages.service_messages import GotoRequest, LoadRequest, SetSpeedRequest
from touchline.schemas.messages.touchline import TraversalStatus
from touchline.schemas.messages.turf_tank import Trajectory
from touchline.schemas.plain_text import plain
from touchline.schemas.plan_cause import PlanCause
from touchline.schemas.template import Template
from touchline.tui import format, orders
from touchline.tui.event_log import ERROR, INFO, WARN
from touchline.tui.goal_orders import GoalOrders
from touchline.tui.job import NOTHING
from touchline.tui.order_registry import ESTOP_TRIES, Change, OrderLine, Phase
from touchline.tui.orders import Order, OrderOutcome, Tried
from touchline.tui.replay_orders import ReplayOrders
from touchline.tui.state import ConsoleState
from touchline.tui.unfinished_job import offered
from touchline.tui.waiting_robot import asks_way, waits_on

WITHDRAWN_AFTER_S = 0.5
"""Time after an emergency stop within which a reset is taken to be typed before it, and must not undo it."""
START_WITHIN_S = 10.0
"""Maximum time for the status to report that the rest of a job is loaded; later nobody expects the robot to start."""
PAUSE_REPORT_S = 1.0
"""Maximum time for the status to report a pause, or the effect of an answer."""


class OrderSender(Protocol):
    """Interface of senders of orders."""

    def send(self, order: Order) -> None:
        """Send an order without waiting; an emergency stop repeatedly."""
        ...

    def post(self, order: Order) -> None:
        """Send an order once, from the calling thread, ignoring the answer."""
        ...

    def cease(self) -> None:
        """Stop repeating the emergency stop."""
        ...


class Operator:
    """Sender of all orders to one robot, and receiver of their outcomes."""

    def __init__(self, state: ConsoleState, sender: OrderSender, session: str) -> None:
        """Create the operator of a robot; `session` makes this console's request ids unique.

        The ids must differ from those of an earlier console, whose answers the services still remember.
        """
        self.state = state
        self.options = PlanOptions()
        self._planned: tuple[Trajectory, PlanOptions] | None = None
        """Last requested plan, and its options."""
        self._sender, self._session = sender, session
        self._orders = count(1)
        self.goals = GoalOrders(state, sender.send, self._request_id)
        self.replay = ReplayOrders(state, self._send, self._request_id)
        self._stopping = threading.Lock()  # a stop may be given from the thread that reads the keys
        self._stopped_at_s = -math.inf
        self._speed_asked: float | None = None
        self._speed_wanted: float | None = None
        """Requested speed factor, until the answer is here."""
        self._start_until_s = -math.inf
        """Deadline for starting the rest of a job that was loaded here, once the robot reports that it is ready."""

    # -- orders ------------------------------------------------------------------------------------------------------

    def command(self, name: str) -> None:
        """Send an order without arguments, by its name in `orders.COMMANDS`."""
        self._start_until_s = -math.inf
        if name == "estop":
            self.stop()
        elif name == "reset" and self.state.orders.stop.phase is Phase.SENT:
            self._withdraw()
        elif name == "pause" and self._pauses_already():
            self.state.say(INFO, "Pause: it pauses already; g goes on")
        elif name in orders.ANSWERS and not self.state.replayed:
            self._answer(name)
        else:
            self._send(orders.command(name, self._request_id()))

    def post_stop(self) -> None:
        """Send an emergency stop once, from any thread; `stop` follows when all robots have received one."""
        self._sender.post(self._stop_order())

    def stop(self) -> None:
        """Stop the robot, from any thread: repeat the stop until the robot's status confirms it."""
        self._sender.send(self._stop_order())

    def _stop_order(self) -> Order:
        """Order of the stop in force, or of a new one; see `StopLatch.press`."""
        latch = self.state.orders.stop
        self._stopped_at_s, self._start_until_s = time.monotonic(), -math.inf
        with self._stopping:
            if latch.phase is not Phase.SENT:
                self.state.note(WARN, "console", "Emergency stop sent")
            request_id = latch.press(self._request_id(), self.state.publisher)
        return orders.command("estop", request_id)

    def _withdraw(self) -> None:
        """Withdraw the emergency stop, unless the reset comes too soon after it."""
        if time.monotonic() - self._stopped_at_s < WITHDRAWN_AFTER_S:
            self.state.say(WARN, "Reset: the emergency stop has only just been given; reset again to withdraw it")
            return
        latch = self.state.orders.stop
        with self._stopping:
            self._sender.cease()
            latch.withdraw()
        self.state.say(WARN, "Emergency stop WITHDRAWN before the robot acknowledged it")

    def _pauses_already(self) -> bool:
        """True if the robot pauses already, so that a space bar that is held down is one pause."""
        return self.state.waits_for_person or self.state.orders.accepted_within(
            "pause", PAUSE_REPORT_S, self.state.now_s
        )

    def _answer(self, name: str) -> None:
        """Send an answer to a waiting robot, once for a key that is held down."""
        state, title = self.state, orders.COMMANDS[name][0]
        if state.orders.accepted_within(name, PAUSE_REPORT_S, state.now_s):
            return
        if not asks_way(state):
            state.say(INFO, f"{title}: the robot does not wait before anything")
        elif name == "wait_on" and waits_on(state):
            state.say(INFO, f"{title}: it waits already until its way is clear")
        else:
            self._send(orders.command(name, self._request_id()))

    def heed_status(self) -> None:
        """Act on changes of the emergency stop in the robot's status."""
        latch = self.state.orders.stop
        if latch.phase is not Phase.OFF and self.state.replayed and not self.state.nodes[topics.ROBOT_SIM].seen:
            self._forget_stop()
        with self._stopping:
            changes, latch.changes = latch.changes, []
        for change in changes:
            if change is Change.ACKNOWLEDGED:
                self._sender.cease()
                self.state.note(WARN, "console", "Emergency stop accepted: the robot's status says so")
            elif change is Change.RELEASED:
                self.state.note(INFO, "console", "the emergency stop has been reset")
            else:
                self.state.note(ERROR, "console", "the robot is back and not stopped: the emergency stop is sent again")
                latch.begin(self._request_id())
                self._sender.send(orders.command("estop", latch.request_id))

    def _forget_stop(self) -> None:
        """Drop a stop that was given before the replay was known."""
        with self._stopping:
            self._sender.cease()
            self.state.orders.stop.withdraw()
        self.state.say(WARN, f"Emergency stop: {self.state.why_replayed}")

    def choose(self, template: Template, text: str) -> None:
        """Show a template."""
        self.state.choose_template(template, text)
        sizes = []
        if template.segments or not template.areas:
            sizes.append(f"{len(template.segments)} lines, {format.length(template.length_m)} of paint")
        if template.areas:
            areas = "1 area" if len(template.areas) == 1 else f"{len(template.areas)} areas"
            sizes.append(f"{areas}, {template.area_m2:.0f} m²")
        self.state.note(INFO, "console", f"Template {plain(template.name)}: {', '.join(sizes)}")

    def may_prepare(self, what: str, *, needs_template: bool) -> bool:
        """True if a new job may be prepared now; else shows the reason."""
        if self.state.replayed:
            self.state.say(WARN, f"{what}: {self.state.why_replayed}")
        elif self.state.busy:
            self.state.say(WARN, f"{what}: the robot is on a job; wait for its end or abort it first")
        elif needs_template and self.state.template is None:
            self.state.say(WARN, f"{what}: choose a template first (t)")
        else:
            return True
        return False

    def plan(self, options: PlanOptions) -> None:
        """Plan the template in view."""
        if self.state.template is None:
            return
        self.options = options
        order = orders.plan(self.state.template.text, self.state.vehicle_json, options, self._request_id())
        if self._send(order):
            self.state.plan_request = order.request_id

    def go_on(self) -> None:
        """Continue the robot's unfinished job: load the rest, and start once it is loaded.

        If the robot's journal has lost the plan, the one in view may be that of the job.
        """
        trajectory, template_json = Trajectory(), ""
        if offered(self.state) is None and self.state.path is not None:
            trajectory = self.state.path.trajectory
            template_json = self.state.template.text if self.state.template is not None else ""
        self._send(orders.go_on(trajectory, template_json, self._request_id()))

    @property
    def start_due(self) -> bool:
        """True, once, if the rest of a job has been loaded and is to be started."""
        state = self.state
        due = state.now_s < self._start_until_s and state.traversal == TraversalStatus.READY and not state.robot_stale
        if due:
            self._start_until_s = -math.inf
        return due

    def load(self) -> None:
        """Load the plan into the robot."""
        if self.state.path is None or self.state.template is None:
            self.state.say(WARN, "Load: plan a template first (p)")
            return
        trajectory, template_json = self.state.path.trajectory, self.state.template.text
        own = self._planned is not None and self._planned[0] is trajectory
        report = self.state.path.report
        cause = PlanCause.of(self._planned[1], report) if self._planned and own and report else None
        cause_json = cause.model_dump_json() if cause else ""
        self._send(orders.load(trajectory, template_json, self._request_id(), cause_json=cause_json))

    def set_speed(self, factor: float) -> None:
        """Set the speed factor of simulated time; queued while another one is being set."""
        if self._send(orders.set_speed(factor, self._request_id())):
            self._speed_asked = factor
        else:
            self._speed_wanted = factor

    def change_speed(self, steps: int) -> None:
        """Change the last requested speed factor by steps, so that no key press is lost."""
        latest = (self._speed_wanted, self._speed_asked, self.state.speed_factor)
        self.set_speed(orders.next_speed(next((speed for speed in latest if speed is not None), None), steps))

    def _request_id(self) -> str:
        return f"tui-{self._session}-{next(self._orders)}"  # next() is safe from every thread

    def _send(self, order: Order) -> bool:
        """Send an order, unless one of the same name is under way."""
        if self.state.replayed and order.service.server in topics.REPLAYED:
            self.state.say(WARN, f"{order.title}: {self.state.why_replayed}")
            return False
        if self.state.orders.under_way(order.name):
            return False
        self.state.orders.place(order.name, order.title, order.attempts, self.state.now_s)
        self._sender.send(order)
        return True

    # -- outcomes ----------------------------------------------------------------------------------------------------

    def tried(self, tried: Tried) -> None:
        """Note that an order was sent again."""
        order = tried.order
        if order.name != "estop":
            self.state.orders.tried(order.name, tried.number)
            return
        latch = self.state.orders.stop
        before = latch.tries
        latch.tried(order.request_id, tried.number)
        if before <= ESTOP_TRIES < latch.tries and latch.phase is Phase.SENT:
            text = f"Emergency stop NOT ACKNOWLEDGED after {ESTOP_TRIES} tries: it is repeated until it is"
            self.state.note(ERROR, "console", text)

    def done(self, outcome: OrderOutcome) -> bool:
        """Process and show the outcome of an order; false if it was not executed or its answer is not valid."""
        if outcome.order.name == "estop":
            return self._stop_answered(outcome)
        if outcome.order.service.server == topics.REPLAY:
            return self._replay_answered(outcome)
        done = self._answered(outcome)
        if isinstance(outcome.order.request, SetSpeedRequest):
            wanted, self._speed_asked, self._speed_wanted = self._speed_wanted, None, None
            if outcome.ok and wanted is not None:
                self.set_speed(wanted)
        return done

    def _replay_answered(self, outcome: OrderOutcome) -> bool:
        """Show outcomes of a replay's orders in the row of the orders, as the log is of the replayed time."""
        order = outcome.order
        fate = outcome.reason if outcome.ok else f"{'not answered' if outcome.failure else 'refused'}: {outcome.reason}"
        word = OrderLine(INFO if outcome.ok else ERROR, plain(f"{order.title}: {fate}"))
        answered, now_s = not outcome.failure, self.state.now_s
        self.state.orders.done(order.name, word, accepted=outcome.ok, answered=answered, now_s=now_s)
        self.replay.answered(order.name, ok=outcome.ok)
        return outcome.ok

    def _answered(self, outcome: OrderOutcome) -> bool:
        order, title = outcome.order, outcome.order.title
        if order.name == "refresh":
            return self.goals.refreshed(outcome)
        if order.name == "preview" and not self.goals.awaited(order):
            return self._last_word(outcome, INFO, f"{title}: the goal has been changed meanwhile")
        if isinstance(outcome.order.request, PlanRequest):
            self.state.plan_done(order.request_id)
        if not outcome.ok:
            self.goals.refused(order, outcome.reason)
            times = f" after {order.attempts} tries" if order.attempts > 1 else ""
            fate = f"not answered{times}" if outcome.failure else "refused"
            return self._last_word(outcome, ERROR, f"{title} {fate}: {outcome.reason}")
        try:
            text = self._take_over(outcome)
        except (TouchlineError, ValueError) as error:
            return self._last_word(outcome, ERROR, f"{title}: the answer is of no use: {error}")
        severity = WARN if order.name == "abort" else INFO
        return self._last_word(outcome, severity, f"{title}: {text or 'done'}", accepted=True)

    def _last_word(self, outcome: OrderOutcome, severity: int, text: str, *, accepted: bool = False) -> bool:
        text, now_s = plain(text), self.state.now_s
        if not self.goals.overtaken(outcome.order):
            word, answered = OrderLine(severity, text), not outcome.failure
            self.state.orders.done(outcome.order.name, word, accepted=accepted, answered=answered, now_s=now_s)
        self.state.note(severity, "console", text)
        return accepted

    def _stop_answered(self, outcome: OrderOutcome) -> bool:
        """Note an answer to the stop, which only the robot's status ends."""
        if outcome.failure:
            return False
        first = self.state.orders.stop.answered(outcome.order.request_id, outcome.reason or "done", self.state.now_s)
        if first:
            severity = WARN if outcome.ok else ERROR
            self.state.note(severity, "console", f"Emergency stop{'' if outcome.ok else ' REFUSED'}: {outcome.reason}")
        return outcome.ok

    def _take_over(self, outcome: OrderOutcome) -> str:
        """Update the state after an accepted order; return the message about it."""
        request, response = outcome.order.request, outcome.response
        if isinstance(request, PlanRequest):
            if request.goal:
                return self.goals.previewed(response)
            if self.state.busy:
                raise TouchlineError("the robot has begun another job meanwhile")
            if self.state.template is None or request.template_json != self.state.template.text:
                raise TouchlineError("another template has been chosen meanwhile")
            self.state.planned(response.trajectory, response.report)
            self._planned = (response.trajectory, request.options)
            report = response.report
            left_out_m = sum(each.length_m for each in report.left_out)
            less = f", {format.length(left_out_m)} of lines left out" if report.left_out else ""
            return f"{format.length(report.total_length_m)} in {format.duration(report.total_time_s)}{less}"
        if isinstance(request, LoadRequest):
            if request.resume:
                self._start_until_s = self.state.now_s + START_WITHIN_S
                self.state.draft = NOTHING
                return outcome.reason
            self.state.handed_over()
            return f"takes {format.duration(response.total_time)}"
        if isinstance(request, GotoRequest):
            self.goals.taken(request.request_id)
            return outcome.reason
        if isinstance(request, SetSpeedRequest):
            self.state.speed_set(request.factor)
            return format.factor(request.factor)
        return outcome.reason
