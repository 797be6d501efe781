"""What is said where robots of a shared job over the bus do not go on: who, why, and what can be done."""

import math
import time
from collections.abc import Sequence

from touchline.jobs.shared.conduct import Conduct
from touchline.jobs.shared.left_work import LeftWork
from touchline.jobs.shared.shared_robot import SharedRobot


def out_of_service(robot: SharedRobot, conduct: Conduct) -> str:
    """Where a robot is that has just failed, why, and what an operator can do.

    Args:
        robot: It.
        conduct: How the job is carried out.
    """
    x, y, _ = robot.place.pose
    by_then = f"no later than {conduct.ordered_within_s:g} s after the others have come to stand"
    if conduct.take_over_after_s is None:
        order = f"TOUCHLINE_ENDPOINT={conduct.endpoint} touchline order take-over --robot {robot.name}"
        remedy = f"have the others do the rest by {order}, {by_then}"
    else:
        remedy = f"the others take over in {conduct.take_over_after_s:g} s"
    return f"{robot.name} is out of service at x {x:.1f} m, y {y:.1f} m: {robot.out}; {remedy}"


def in_the_way(robots: Sequence[SharedRobot], left: LeftWork, conduct: Conduct) -> str:
    """What an operator can do where all is done but what robots that have failed stand in the way of.

    Args:
        robots: They.
        left: What cannot be reached beside them.
        conduct: How the job is carried out.
    """
    names = " and ".join(robot.name for robot in robots)
    order = f"TOUCHLINE_ENDPOINT={conduct.endpoint} touchline order remove --robot {robots[0].name}"
    return (
        f"all is done but {left}, beside {names}: carry it away, say so by {order}, and order take-over likewise; "
        f"the job ends in {conduct.ordered_within_s:g} s without"
    )


def paused_since(paused: Sequence[SharedRobot]) -> str:
    """Who is paused by an operator, and since when by the clock on the wall."""
    clocks = (time.strftime("%H:%M:%S", time.localtime(robot.paused_since)) for robot in paused)
    return f"paused: {', '.join(f'{robot.name} since {at}' for robot, at in zip(paused, clocks, strict=True))}"


def why_not_finished(failed: Sequence[SharedRobot], left: Sequence[str], conduct: Conduct, *, undone: bool) -> str:
    """Why a job ends before all is done.

    Args:
        failed: Who is out of service.
        left: The names of the lines that are not painted to the end, or how much of which areas is not covered.
        conduct: How the job was carried out.
        undone: Whether the others cannot do the rest.
    """
    why = "; ".join(f"{robot.name} is out of service: {robot.out}" for robot in failed) or "a rest could not be done"
    told = f"nobody has ordered another to take over within {conduct.ordered_within_s:g} s"
    if undone:
        told = "the others cannot do the rest"
    return f"{why}; {told}; not finished: {', '.join(left)}"


def why_not_done(crew: Sequence[SharedRobot]) -> str:
    """What those say that are not done."""
    waiting = (robot for robot in crew if not robot.done)
    return "; ".join(f"{each.name}: {each.out or each.status.reason or _where(each)}" for each in waiting)


def _where(robot: SharedRobot) -> str:
    """Where on its way a robot stands that gives no reason, and how far it was told that it may drive."""
    until = f"{robot.until_m:.1f} m" if math.isfinite(robot.until_m) else "its end"
    return f"stands at {robot.furthest_m:.1f} m of its way, and may drive to {until}"
