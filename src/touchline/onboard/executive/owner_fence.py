"""Fence of a robot against former owners: it obeys one at a time, and each new one in a higher epoch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

NO_EPOCH: Final = 0
"""Epoch of a robot that nobody has owned yet."""


@dataclass
class OwnerFence:
    """Owner of a robot.

    Attributes:
        owner: Who guides it; "" before the first.
        epoch: Number of the ownership.
    """

    owner: str = ""
    epoch: int = NO_EPOCH

    def take(self, owner: str, epoch: int) -> bool:
        """Take a new owner if the epoch is higher than that of the last; return whether this one owns the robot now."""
        if epoch > self.epoch:
            self.owner, self.epoch = owner, epoch
        return self.obeys(owner, epoch)

    def obeys(self, owner: str, epoch: int) -> bool:
        """Return whether a command of this owner and epoch is to be obeyed."""
        return (owner, epoch) == (self.owner, self.epoch)
