"""How a shared job over the bus is carried out."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Conduct:
    """See the module.

    Attributes:
        speed: Sim seconds per wall second; negative for as fast as it goes.
        take_over_after_s: Wall clock after which the others do what a robot that has failed has left, without an
            operator; None: on an operator's order only.
        record: File to record all robots to, if any.
        endpoint: Of the bus, to be told to operators.
        ordered_within_s: So long (wall clock) after anybody has moved an order is waited for where a robot has failed.
    """

    speed: float
    take_over_after_s: float | None = None
    record: Path | None = None
    endpoint: str = ""
    ordered_within_s: float = 120.0
