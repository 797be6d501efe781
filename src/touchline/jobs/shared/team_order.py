"""What an operator orders a team while it works, what befalls its robots, and what has come of that."""

from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple, get_args

OrderKind = Literal["pause", "resume", "fail", "take-over", "remove"]
ORDER_KINDS: Final[tuple[OrderKind, ...]] = get_args(OrderKind)


class TeamOrder(NamedTuple):
    """What an operator orders, or what happens, while they work.

    Attributes:
        at_s: When, in sim time.
        robot: Which, by number from 0.
        kind: "pause", "resume"; "fail": it stops at once and for good; "take-over": the others do what is left of all
            shares, that of this one which has failed among them; "remove": one that has failed is carried away.
    """

    at_s: float
    robot: int
    kind: OrderKind


@dataclass
class OrderTaken:
    """An order, and what has come of it.

    Attributes:
        order: It.
        outcome: For people; what is said first of one that was given.
        done: Whether it has had the effect that it should.
    """

    order: TeamOrder
    outcome: str = "not carried out: the job was given up before"
    done: bool = False

    def figures(self) -> dict[str, Any]:
        """As a JSON object."""
        order = self.order
        return {
            "at_s": order.at_s,
            "robot": f"r{order.robot + 1}",
            "order": order.kind,
            "done": self.done,
            "outcome": self.outcome,
        }
