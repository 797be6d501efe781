"""Messages about robots of a shared job that do not continue, with reasons and remedies."""

import math
import time
from collections.abc import Sequence

from touchline.jobs.shared.remaining_work import RemainingWork
from touchline.jobs.shared.shared_robot import SharedRobot
from touchline.jobs.shared.shared_run_settings import SharedRunSettings


def out_of_service(robot: SharedRobot, settings: SharedRunSettings) -> str:
    """Describe where a robot failed, why, and what an operator can do.

    Args:
        robot: The robot.
        settings: Settings of the job.
    """
    x, y, _ = robot.place.pose
    by_then = f"no later than {settings.ordered_within_s:g} s after the others stand"
    if settings.take_over_after_s is None:
        remedy = f"have the others do the rest by {settings.order('take-over', robot.name)}, {by_then}"
    else:
        remedy = f"the others take over in {settings.take_over_after_s:g} s"
    return f"{robot.name} is out of service at x {x:.1f} m, y {y:.1f} m: {robot.out}; {remedy}"


def in_the_way(robots: Sequence[SharedRobot], remaining: RemainingWork, settings: SharedRunSettings) -> str:
    """Describe what an operator can do where failed robots obstruct the only remaining work.

    Args:
        robots: The failed robots.
        remaining: The work that cannot be reached beside them.
        settings: Settings of the job.
    """
    names = " and ".join(robot.name for robot in robots)
    order = settings.order("remove", robots[0].name)
    return (
        f"all is done but {remaining}, beside {names}: carry it away, confirm that by {order}, "
        f"and order take-over likewise; the job ends in {settings.ordered_within_s:g} s without"
    )


def paused_since(paused: Sequence[SharedRobot]) -> str:
    """List the robots that are paused by an operator, each with the time by the wall clock."""
    clocks = (time.strftime("%H:%M:%S", time.localtime(robot.paused_since)) for robot in paused)
    return f"paused: {', '.join(f'{robot.name} since {at}' for robot, at in zip(paused, clocks, strict=True))}"


def why_not_finished(
    failed: Sequence[SharedRobot], remaining: Sequence[str], settings: SharedRunSettings, *, undone: bool
) -> str:
    """Describe why a job ends before all is done.

    Args:
        failed: Robots out of service.
        remaining: Names of unfinished lines, or amounts of uncovered areas.
        settings: Settings of the job.
        undone: True if the others cannot do the rest.
    """
    why = "; ".join(f"{robot.name} is out of service: {robot.out}" for robot in failed) or "a rest could not be done"
    ending = f"nobody has ordered another to take over within {settings.ordered_within_s:g} s"
    if undone:
        ending = "the others cannot do the rest"
    return f"{why}; {ending}; not finished: {', '.join(remaining)}"


def why_not_done(crew: Sequence[SharedRobot]) -> str:
    """Return the reasons of robots that are not done."""
    waiting = (robot for robot in crew if not robot.done)
    return "; ".join(f"{each.name}: {each.out or each.status.reason or _where(each)}" for each in waiting)


def _where(robot: SharedRobot) -> str:
    """Describe where a robot without a reason stands, and how far it may drive."""
    until = f"{robot.until_m:.1f} m" if math.isfinite(robot.until_m) else "its end"
    return f"stands at {robot.furthest_m:.1f} m of its path, and may drive to {until}"
