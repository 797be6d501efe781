"""What robots and their coordinator, the hub, tell each other over links that lose, delay and reorder messages.

A robot says where it is: its name, a stamp of its own clock, its stopping segment S, and which cell it keeps to. The
hub says where it may be: a cell with a number, a target, and an echo of a stamp. Of a cell's half-planes each belongs
to a numbered plane between two robots, of which the other robot's cell may hold the other side.

A robot:

1. keeps to one cell, the one it has *adopted*, by the cells' rule of motion;
2. looks at a cell only if its number is higher than that of any it has looked at (*decided*), and adopts it if S as it
   is then lies in it, else never;
3. drives only while its clock is within the *lease* of the newest stamp that has been echoed to it, else it brakes;
4. says with S which number it has adopted, and up to which it has decided.

The hub:

1. holds for each robot the cells that it *may be using*: the one that it has last said to have adopted, and all
   that were made since the highest number that it had decided by then;
2. makes a new cell only of half-planes such that for every other robot, each cell which that one may be using shares a
   plane with it;
3. echoes the newest stamp that it has. A robot of which it has heard nothing newer for a second gets no more cells;
   after the lease and the time to brake it is *at rest*: all cells that it may be using are dead, it stands in one of
   them within reach of its last S, and for others that much is an obstacle;
4. passes over what a robot said before it came to rest. When one at rest is heard again, it makes it cells by rule 2,
   and echoes its stamps again only when it has adopted one of these.

So any two robots that may drive keep to the two sides of one and the same plane, whatever has been lost: docs/fleet.md
has the proof, and says what is wrong with the simpler rule by which each of two robots goes on to the newest plane for
which it has the other's S.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.services.fleet.cells import BufferedCell

Floats = NDArray[np.float64]

FIRST_CELL: Final = 0
"""The number of the cell that everybody has where it stands at the start."""
# Rounding may leave who stands at a side of its cell this far (m) beyond it.
_ROUNDING_M: Final = 1e-9


class Whereabouts(NamedTuple):
    """What a robot says of itself.

    Attributes:
        name: Its own.
        stamp_s: Of its own clock; every message has a later one.
        segment: (4,) S: x₁ y₁ x₂ y₂ (m).
        adopted: Number of the cell that it keeps to.
        decided: The highest number that it has adopted or refused.
    """

    name: str
    stamp_s: float
    segment: Floats
    adopted: int = FIRST_CELL
    decided: int = FIRST_CELL


class NumberedCell(NamedTuple):
    """What the hub says to a robot.

    Attributes:
        name: The robot's.
        number: Of the cell.
        cell: Where it may be.
        target_m: Where it should go, in the cell.
        echo_s: The newest stamp of the robot that counts.
    """

    name: str
    number: int
    cell: BufferedCell
    target_m: tuple[float, float]
    echo_s: float


class RobotEnd:
    """The robot's side: which cell it keeps to, and whether it may drive."""

    def __init__(self, name: str, lease_s: float) -> None:
        """It has no cell yet, and stands."""
        self._name, self._lease_s = name, lease_s
        self._decided, self._echo_s = FIRST_CELL, -np.inf
        self._kept: NumberedCell | None = None

    def receive(self, message: NumberedCell, segment: Floats) -> None:
        """Take a message, in whatever order they come.

        Args:
            message: To this robot.
            segment: (4,) its stopping segment now (m).
        """
        self._echo_s = max(self._echo_s, message.echo_s)
        if message.number > self._decided:
            self._decided = message.number
            if message.cell.excess_m(segment) <= _ROUNDING_M:
                self._kept = message

    def say(self, stamp_s: float, segment: Floats) -> Whereabouts:
        """What to tell the hub now."""
        adopted = self._kept.number if self._kept else FIRST_CELL
        return Whereabouts(self._name, stamp_s, segment, adopted, self._decided)

    def may_drive(self, now_s: float) -> bool:
        """Whether it may do anything but brake, at a time of its own clock."""
        return self._kept is not None and now_s <= self._echo_s + self._lease_s

    @property
    def kept(self) -> NumberedCell | None:
        """The cell that it keeps to; None where it stood at the start."""
        return self._kept
