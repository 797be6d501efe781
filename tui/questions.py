"""Questions that are asked before an order is sent."""

from __future__ import annotations

from collections.abc import Callable, Collection

from touchline.tui import supply_check
from touchline.tui.dialogs import ConfirmDialog
from touchline.tui.fleet_orders import FleetOrder, census, concerned
from touchline.tui.robots import Robots
from touchline.tui.state import ConsoleState
from touchline.tui.unfinished_job import name_of, offered, share_done
from touchline.tui.void_question import TO_ABORT, TO_LOAD, TO_START, why_void


def before_start(state: ConsoleState) -> ConfirmDialog | None:
    """Ask if tank or battery may not last for the loaded plan; None if they do."""
    supplies = supply_check.of_job(state)
    doubts = (*supplies.shortages, *supplies.unknown)
    if not doubts or not state.path_loaded or state.busy:
        return None
    text = "\n".join(f"The job {shortage}." for shortage in doubts)
    note = "The robot stops on the line when it runs out, and goes on after a resume."
    title = f"Start{_which(state)} all the same?"
    return ConfirmDialog(title, f"{text}\n{note}", "Start", why_void(state, TO_START))


def before_load(state: ConsoleState) -> ConfirmDialog | None:
    """Ask if the plan in view would replace an unfinished job; None if it would not."""
    job = offered(state)
    if job is None or state.path is None or not state.path.rows:
        return None
    text = (
        f"{name_of(job)} is {share_done(state, job)}. Once this plan is started, the rest of that job is dropped, "
        "and all of this plan is done, over what is there already. To go on with the rest: no, then g."
    )
    return ConfirmDialog(f"Begin{_which(state)} anew?", text, "Anew", why_void(state, TO_LOAD))


def before_abort(state: ConsoleState) -> ConfirmDialog:
    """Ask whether to abort the job."""
    title = "Abort this job?" if state.alone else f"Abort the job of{_which(state)}?"
    text = "The robot stops, and another job can be loaded. To do later what is left: g. To halt only: space."
    return ConfirmDialog(title, text, "Abort", why_void(state, TO_ABORT))


def before_leaving(robots: Robots) -> ConfirmDialog | None:
    """Ask if a robot is on a job, or has not acknowledged an emergency stop; None if all are at rest."""
    busy = robots.busy
    if robots.stopping:
        text = "A robot has not acknowledged the emergency stop, which only this console repeats."
    elif busy:
        who = "The robot is on a job" if robots.selected.alone else f"On a job: {', '.join(busy)}"
        text = f"{who}. Nobody watches it from here once this console is closed."
    else:
        return None
    return ConfirmDialog("Leave the console?", text, "Leave")


def before_all(order: FleetOrder, names: Collection[str], robots: Robots, stopped: Callable[[], bool]) -> ConfirmDialog:
    """Ask whether to send an order to several robots.

    Args:
        order: The order.
        names: Robots that it is to go to.
        robots: All robots.
        stopped: Returns whether an emergency stop has been given since.
    """

    def void() -> str:
        if stopped():
            return "emergency stop"
        return "" if concerned(order, robots.states) else "there are no robots for it any more"

    title = f"{order.title} {len(names)} of {len(robots.states)} robots?"
    text = f"It goes to {order.whom}.\nAll robots: {census(robots.states)}."
    return ConfirmDialog(title, text, f"{order.title} {len(names)}", void)


def _which(state: ConsoleState) -> str:
    """Name of the robot for questions, if there are several."""
    return "" if state.alone else f" {state.name}"
