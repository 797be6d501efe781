"""What the traversal executive needs of that which the robot is doing."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from touchline.onboard.interface import TICK_S, Command, PaintBelief


class Step(NamedTuple):
    """A tick of a running job: the command, and whether it ends the running."""

    command: Command
    hold: str = ""
    """Why to pause until it is better."""
    refusal: str = ""
    """Why to give up."""
    done: bool = False


class JobProgress(NamedTuple):
    """How far a job has come; fields as in `Status`."""

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
        """How far it has come."""
        ...

    @property
    def place(self) -> tuple[int, float, float | None] | None:
        """Where another process could go on: the first three of `Checkpoint`; None if it could not."""
        ...

    @property
    def aligning(self) -> bool:
        """Whether the robot has not yet set off."""
        ...

    @property
    def waiting(self) -> bool:
        """Whether the robot, though told to go on, stands until its accelerometer agrees with the standing wheels."""
        ...

    @property
    def held(self) -> bool:
        """Whether the robot has come to where it may drive no further for now."""
        ...

    @property
    def nominal(self) -> bool:
        """Whether nothing has to be decided while it drives on."""
        ...

    @property
    def standing(self) -> bool:
        """Whether the robot neither is told to move nor does."""
        ...

    @property
    def spraying(self) -> bool:
        """Whether the valve is commanded open."""
        ...

    @property
    def painted(self) -> PaintBelief:
        """What the robot believes it has painted, or covered."""
        ...

    @property
    def lateral_error_m(self) -> float:
        """Estimated distance of the nozzle to the left of its path."""
        ...

    @property
    def next_paint_m(self) -> float:
        """Arc length at which work goes on after a stop."""
        ...

    def run(self) -> Step:
        """One tick of driving and working."""
        ...

    def rest(self) -> Command:
        """One tick of coming to rest, valve closed."""
        ...

    def stop_hard(self) -> Command:
        """One tick of braking as hard as the wheels can."""
        ...

    def close_valve(self, in_s: float = TICK_S) -> None:
        """Close the valve."""
        ...

    def owe_dry(self, dry_s: float) -> None:
        """Close the valve, and owe what it has sprayed dry in the last `dry_s` seconds."""
        ...

    def locate(self) -> float:
        """Find the standing robot's place anew; returns how far beside its path that is [m]."""
        ...

    def go_on(self) -> None:
        """Drive on after a stop."""
        ...
