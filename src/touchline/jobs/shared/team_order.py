"""Scheduled orders to a team and failures of its robots, with their outcomes."""

from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple, get_args

OrderKind = Literal["pause", "resume", "fail", "take-over", "remove"]
ORDER_KINDS: Final[tuple[OrderKind, ...]] = get_args(OrderKind)


class TeamOrder(NamedTuple):
    """An order or an incident during the work.

    Attributes:
        at_s: Sim time.
        robot: Number of the robot, from 0.
        kind: "pause", "resume"; "fail": it stops at once and for good; "take-over": the others take over all remaining
            work, that of this failed robot included; "remove": a failed robot is carried away.
    """

    at_s: float
    robot: int
    kind: OrderKind


@dataclass
class OrderTaken:
    """An order and its outcome.

    Attributes:
        order: The order.
        outcome: Text; the first one counts.
        done: True if it had its effect.
    """

    order: TeamOrder
    outcome: str = "not carried out: the job was aborted before"
    done: bool = False

    def figures(self) -> dict[str, Any]:
        """Return the order as a JSON object."""
        order = self.order
        return {
            "at_s": order.at_s,
            "robot": f"r{order.robot + 1}",
            "order": order.kind,
            "done": self.done,
            "outcome": self.outcome,
        }
