"""Settings of a shared job over the bus."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class SharedRunSettings:
    """Pace, take-over, recording and timeout of a shared job.

    Attributes:
        speed: Sim seconds per wall second; negative for as fast as possible.
        take_over_after_s: Wall-clock time after which the others take over a failed robot's work without an operator;
            None: on an operator's order only.
        record: File to record all robots to, if any.
        endpoint: Endpoint of the bus, shown to operators.
        ordered_within_s: Wall-clock time after the last motion within which an order has to arrive once a robot has
            failed.
        identity: Name of the operator's identity on a secured bus, shown to operators.
    """

    speed: float
    take_over_after_s: float | None = None
    record: Path | None = None
    endpoint: str = ""
    ordered_within_s: float = 120.0
    identity: str = ""

    def order(self, name: str, robot: str) -> str:
        """Return the command by which an operator gives an order to a robot."""
        identity = f" --identity {self.identity}" if self.identity else ""
        return f"TOUCHLINE_ENDPOINT={self.endpoint} touchline order {name} --robot {robot}{identity}"
