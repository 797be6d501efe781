"""``--robot-order T:ROBOT:WORD``: scheduled orders to and failures of a simulated team."""

import math
from collections.abc import Sequence
from typing import Annotated, Final

import typer

from touchline.jobs.shared.team_order import ORDER_KINDS, TeamOrder
from touchline.schemas.errors import SpecError

LATEST_S: Final = 86_400.0
_WORDS: Final = ", ".join(ORDER_KINDS)

OrdersOption = Annotated[
    list[str] | None,
    typer.Option(
        "--robot-order",
        metavar="T:ROBOT:WORD",
        help=f"With --robots: at sim time T (s), WORD ({_WORDS}) happens to robot ROBOT (1 to N), such as "
        "200:2:fail; may be repeated.",
    ),
]


def orders_of(texts: Sequence[str], robots: int) -> list[TeamOrder]:
    """Parse the orders of the command line.

    Args:
        texts: One per order.
        robots: Number of robots.

    Raises:
        SpecError: An order is invalid, or there is no team.
    """
    if texts and robots < 2:
        raise SpecError("command line", "--robot-order", "is given without --robots", "give --robots 2 or more, too")
    return [_order_of(text, robots) for text in texts]


def _order_of(text: str, robots: int) -> TeamOrder:
    parts = text.split(":")
    if len(parts) != 3:
        raise _unusable(text, f"has {len(parts)} of 3 parts", "write T:ROBOT:WORD, as in 200:2:fail")
    at, robot, word = parts
    try:
        at_s = float(at)
    except ValueError:
        at_s = math.nan
    if not 0.0 <= at_s <= LATEST_S:
        raise _unusable(text, f"has the time {at!r}", f"give seconds of sim time from 0 to {LATEST_S:.0f}")
    numbers = {str(number + 1): number for number in range(robots)}
    if robot not in numbers:
        raise _unusable(text, f"has the robot {robot!r}", f"give a number from 1 to {robots}")
    for kind in ORDER_KINDS:
        if kind == word:
            return TeamOrder(at_s, numbers[robot], kind)
    raise _unusable(text, f"has the word {word!r}", f"use one of {_WORDS}")


def _unusable(text: str, problem: str, remedy: str) -> SpecError:
    return SpecError("command line", f"--robot-order {text}", problem, remedy)
