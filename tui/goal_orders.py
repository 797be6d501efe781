"""Orders about goals: aim, preview, update the preview of a driving robot, and send."""

from __future__ import annotations

from collections.abc import Callable

from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages.plan_messages import PlanOptions, PlanRequest, PlanResponse, PoseGoal
from touchline.schemas.messages.touchline import TraversalStatus
from touchline.schemas.messages.turf_tank import Trajectory
from touchline.schemas.path_start import PathStart, hindrance
from touchline.tui import orders
from touchline.tui.event_log import WARN
from touchline.tui.goal_draft import PlanAsked
from touchline.tui.orders import Order, OrderOutcome
from touchline.tui.robot import ShownPose
from touchline.tui.state import ConsoleState

REFRESH_S = 1.0
"""Period of updates of the preview from a driving robot."""
DRAWN_S = 5.0
"""Age from which a preview from a driving robot is dropped."""
UNANSWERED = "the planner does not answer"
UNSEEN = "no preview: the robot finds its position only when it is to drive, and plans from there"
_KEYS = {TraversalStatus.PAUSED: "g, a", TraversalStatus.ESTOPPED: "r"}


def why_no_goal(state: ConsoleState) -> str:
    """Reason why no drive to a goal can be prepared and sent now, with the remedy; "" if it can."""
    if state.replayed:
        return state.why_replayed
    if state.traversal is None:
        return "no robot has reported its state; wait for it"
    if problem := hindrance(state.traversal):
        return f"the robot is {problem} ({_KEYS[state.traversal]})"
    if state.traversal == TraversalStatus.RUNNING and not state.loaded.drives:
        return "the robot is on a job; wait for its end or abort it first (a)"
    if state.busy and state.robot_stale:
        return "nothing is heard of the driving robot; stop it (e), or wait"
    return ""


def path_start(state: ConsoleState) -> PathStart:
    """Start of a path from the robot's last report."""
    here, path, status = state.robot.pose, state.loaded.path, state.robot.status
    return PathStart(
        state=state.traversal if state.traversal is not None else TraversalStatus.IDLE,
        pose=(here.x_m, here.y_m, here.heading_rad) if here is not None else (),
        trajectory=path.trajectory if path is not None else Trajectory(),
        arc_length_m=status.arc_length_m if status is not None else 0.0,
        pace=state.pace,
    )


class GoalOrders:
    """Orders to one robot about goals, and their outcomes."""

    def __init__(self, state: ConsoleState, send: Callable[[Order], None], request_id: Callable[[], str]) -> None:
        """Use `send` (does not wait), and `request_id` for new ids."""
        self._state, self._send_order, self._request_id = state, send, request_id
        self._newest: dict[str, str] = {}
        """Request id of the last order of each name."""

    # -- what the operator does --------------------------------------------------------------------------------------

    def aim(self) -> None:
        """Begin to aim at a goal, from the robot's last reported position."""
        if self._state.drive.goal is None and self._may("Drive"):
            here = self._state.robot.pose or ShownPose(0.0, 0.0, 0.0)
            self._state.drive.begin(round(here.x_m, 2), round(here.y_m, 2))

    def leave(self) -> None:
        """Stop aiming; a goal that has been sent is not revoked."""
        if self._state.drive.sent_id:
            self._state.say(WARN, "Drive: the goal has been sent, the robot may set off; pause (space) or abort (a) it")
        self._state.drive.leave()

    def preview(self) -> None:
        """Plan the path to the goal from the robot's estimated pose, or from amid its drive."""
        draft = self._state.drive
        if draft.goal is None or draft.asked is not None or not self._may("Preview"):
            return
        if self._state.robot.pose is None:
            draft.go_unseen(UNSEEN)
            return
        request = self._request(draft.goal)
        draft.ask(self._noted(request))
        self._send(orders.preview(request))

    def drive(self) -> None:
        """Send the previewed goal to the robot; of several goals under way the newest counts."""
        draft = self._state.drive
        if draft.goal is None or not draft.ready or draft.sent_id or not self._may("Drive"):
            return
        if self._running and not draft.shown.under_way:
            draft.unseen = False
            self._state.say(WARN, "Drive: the robot has set off meanwhile; look at the path from there first")
            return
        order = orders.drive(draft.goal, self._request_id())
        draft.send(order.request_id)
        self._send(order)

    # -- what goes on by itself --------------------------------------------------------------------------------------

    def refresh(self) -> None:
        """Update the preview for a robot that drives, or that has come to rest since."""
        draft, now_s = self._state.drive, self._state.now_s
        if draft.goal is None or draft.path is None or draft.sent_id:
            return
        if problem := why_no_goal(self._state):
            draft.drop(problem)
            return
        if not self._running and not draft.shown.under_way:
            return
        if draft.shown.under_way and now_s - draft.shown.at_s > DRAWN_S:
            draft.drop(f"the preview was {DRAWN_S:.0f} s old: {draft.trouble or UNANSWERED}")
        elif draft.asked is None and now_s - draft.asked_s >= REFRESH_S:
            request = self._request(draft.goal)
            draft.ask_again(self._noted(request))
            self._send_order(orders.refresh(request))

    # -- outcomes ----------------------------------------------------------------------------------------------------

    def overtaken(self, order: Order) -> bool:
        """True if a newer order of this name has been sent."""
        return self._newest.get(order.name, order.request_id) != order.request_id

    def awaited(self, order: Order) -> bool:
        """True if the goal is still the one of this preview."""
        asked = self._state.drive.asked
        return asked is not None and asked.request_id == order.request_id

    def refreshed(self, outcome: OrderOutcome) -> bool:
        """Take an updated preview silently; false if there is none."""
        draft = self._state.drive
        if not self.awaited(outcome.order):
            return False
        if outcome.ok:
            try:
                self.previewed(outcome.response)
            except (TouchlineError, ValueError) as error:
                draft.not_planned(str(error))
        else:
            draft.not_planned(UNANSWERED if outcome.failure else outcome.reason)
        return not draft.trouble

    def previewed(self, response: PlanResponse) -> str:
        """Take the preview and return the planner's message.

        Raises:
            ValueError: The plan is not valid.
        """
        self._state.drive.planned(response.trajectory, response.report, response.message)
        return response.message

    def refused(self, order: Order, why: str) -> None:
        """Process a refusal: there is no plan, or the robot does not take the goal."""
        if self.awaited(order):
            self._state.drive.not_planned(why)
        elif order.request_id == self._state.drive.sent_id:
            self._state.drive.drop(why)

    def taken(self, request_id: str) -> None:
        """Process the acceptance of a goal; the operator may aim at another one by now."""
        if request_id == self._state.drive.sent_id:
            self._state.drive.leave()

    # -- how -----------------------------------------------------------------------------------------------------------

    @property
    def _running(self) -> bool:
        return self._state.traversal == TraversalStatus.RUNNING

    def _may(self, what: str) -> bool:
        if problem := why_no_goal(self._state):
            self._state.say(WARN, f"{what}: {problem}")
        return not problem

    def _request(self, goal: PoseGoal) -> PlanRequest:
        """Create the request for a path from the robot's present state, as the robot would."""
        start = path_start(self._state)
        return start.request(goal, PlanOptions(), self._state.vehicle_json, self._request_id())

    def _noted(self, request: PlanRequest) -> PlanAsked:
        return PlanAsked(request.request_id, self._state.now_s, bool(request.leaving))

    def _send(self, order: Order) -> None:
        """Send an order, even while another one of its name is under way."""
        self._newest[order.name] = order.request_id
        self._state.orders.place(order.name, order.title, order.attempts, self._state.now_s)
        self._send_order(order)
