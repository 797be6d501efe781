"""Interface between the traversal executive and its job."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from touchline.onboard.control.follower import Asking
from touchline.onboard.interface import TICK_S, Command, PaintBelief


class Step(NamedTuple):
    """Result of a tick of a running job: the command, and whether it ends the running."""

    command: Command
    waits: str = ""
    """Reason to drive no farther than the robot may without what it waits for."""
    hold: str = ""
    """Reason to pause until it is better."""
    refusal: str = ""
    """Reason to abort."""
    done: bool = False


class JobProgress(NamedTuple):
    """Progress of a job; fields as in `Status`."""

    segment_index: int = 0
    segment_count: int = 0
    segment_id: str = ""
    arc_length_m: float = 0.0
    total_length_m: float = 0.0
    remaining_s: float = 0.0


class TraversalJob(Protocol):
    """A mission along a trajectory, or guided driving."""

    @property
    def progress(self) -> JobProgress:
        """Progress of the job."""
        ...

    @property
    def place(self) -> tuple[int, float, float | None] | None:
        """Place from which another process could continue, the first three fields of `Checkpoint`; None: nowhere."""
        ...

    @property
    def aligning(self) -> bool:
        """True if the robot has not yet set off."""
        ...

    @property
    def waiting(self) -> bool:
        """True if the robot is to continue but stands until its accelerometer agrees with the standing wheels."""
        ...

    @property
    def held(self) -> bool:
        """True if the robot has come to the end of its authority."""
        ...

    @property
    def nominal(self) -> bool:
        """True if nothing has to be decided while the robot drives on."""
        ...

    @property
    def standing(self) -> bool:
        """True if the robot is neither commanded to move nor moves."""
        ...

    @property
    def spraying(self) -> bool:
        """True if the valve is commanded open."""
        ...

    @property
    def painted(self) -> PaintBelief:
        """Estimated paint or covered ground."""
        ...

    @property
    def lateral_error_m(self) -> float:
        """Estimated distance of the nozzle to the left of its path [m]."""
        ...

    @property
    def next_paint_m(self) -> float:
        """Arc length at which work continues after a stop."""
        ...

    @property
    def way(self) -> tuple[int, bool]:
        """Leg that the robot is on, and whether it returns along it."""
        ...

    @property
    def returns(self) -> bool:
        """True if the robot, when it goes on after a stop, first returns along its path."""
        ...

    def lay_way(self, *, back: bool) -> None:
        """Lay the way to come in the computer's state: forward, or back along the leg."""
        ...

    def run(self) -> Asking[Step]:
        """Run one tick of driving and working."""
        ...

    def rest(self) -> Asking[Command]:
        """Run one tick of coming to rest, valve closed."""
        ...

    def stop_hard(self) -> Command:
        """Run one tick of braking as hard as the wheels can."""
        ...

    def close_valve(self, in_s: float = TICK_S) -> None:
        """Close the valve."""
        ...

    def owe_dry(self, dry_s: float) -> None:
        """Close the valve, and owe the stretch that was sprayed dry in the last `dry_s` seconds."""
        ...

    def owe_moved(self, ahead_m: float) -> None:
        """Owe paint from further back if the position has been moved back."""
        ...

    def locate(self) -> float:
        """Find the standing robot's place anew; return its distance beside the path [m]."""
        ...

    def go_on(self) -> None:
        """Drive on after a stop."""
        ...
