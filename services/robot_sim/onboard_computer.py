"""Interface of the robot's own computer for the emulator."""

from collections.abc import Sequence
from typing import Any, Protocol

from touchline.onboard.executive.traversal import (
    ABORTED_BY_OPERATOR,
    BY_OPERATOR,
    EMERGENCY_STOP,
    PAUSED_BY_OPERATOR,
)
from touchline.onboard.interface import (
    AuxiliarySample,
    Checkpoint,
    Command,
    Consistency,
    Estimate,
    MoveOffWarning,
    OnboardEvent,
    PaintBelief,
    Pause,
    SensorFrame,
    Status,
)
from touchline.schemas.messages import Guidance, Trajectory, Whereabouts


class OnboardComputer(Protocol):
    """The robot's own computer, one tick at a time; commands raise `CommandRefused`."""

    @property
    def estimate(self) -> Estimate:
        """Estimated pose and twist of the robot."""

    @property
    def status(self) -> Status:
        """Status of the traversal."""

    @property
    def state(self) -> int:
        """State in `status`."""

    @property
    def warning(self) -> MoveOffWarning | None:
        """Warning that it gives before and while the robot moves."""

    @property
    def consistency(self) -> Consistency:
        """Consistency of the estimate."""

    @property
    def lateral_error_m(self) -> float:
        """Estimated distance of the nozzle to the left of its path [m]."""

    @property
    def spraying(self) -> bool:
        """True if it commands the valve open."""

    @property
    def painted(self) -> PaintBelief:
        """Estimated paint."""

    @property
    def aligned(self) -> bool:
        """True if it knows its pose well enough to drive off."""

    @property
    def checkpoint(self) -> Checkpoint | None:
        """Checkpoint from which another process could continue."""

    def check_load(self) -> None:
        """Check that a trajectory would be accepted now."""

    def prepare(self, trajectory: Trajectory, boundary: Sequence[tuple[float, float]] = ()) -> Any:
        """Check a trajectory without changing anything.

        Args:
            trajectory: Path, speeds and actuation.
            boundary: Corners (x, y) [m] of the area that the robot must not leave.
        """

    def take(self, course: Any, resume: Checkpoint | None = None) -> float:
        """Take a prepared course.

        Args:
            course: Result of `prepare`.
            resume: Checkpoint to begin at; None: the start.

        Returns:
            Planned duration [s].
        """

    def take_here(self, course: Any) -> float:
        """Take a course that begins where the robot stands, as `take`."""

    def take_over(self, course: Any) -> float:
        """Take a course while driving, without a stop, as `take`."""

    def begin_guided(self) -> None:
        """Follow a coordinator's guidance from now on."""

    def take_guidance(self, guidance: Guidance) -> bool:
        """Take guidance from the coordinator; return False if it cannot be used, or the robot is not guided."""

    @property
    def guided(self) -> bool:
        """True if a coordinator guides the robot, emergency-stopped or not."""

    @property
    def whereabouts(self) -> Whereabouts | None:
        """Message of a guided robot to its coordinator; None if it is not guided."""

    def start(self) -> None:
        """Begin the traversal."""

    def pause(self, reason: str = PAUSED_BY_OPERATOR, by: Pause = BY_OPERATOR) -> None:
        """Brake and close the valve.

        Args:
            reason: Shown to the operator.
            by: Cause and source of the pause.
        """

    def resume(self) -> None:
        """Continue after a pause."""

    def abort(self, reason: str = ABORTED_BY_OPERATOR) -> None:
        """Brake and abort the traversal."""

    def estop(self, reason: str = EMERGENCY_STOP) -> None:
        """Stop at once and latch."""

    def reset(self) -> None:
        """Release the latch."""

    def authorize(self, until_m: float) -> None:
        """Allow driving up to this arc length only [m], which later calls may extend."""

    def link_lost(self) -> None:
        """Pause if under way, because the link to the operator is lost."""

    def take_samples(self, samples: Sequence[AuxiliarySample]) -> None:
        """Use measurements of auxiliary sensors."""

    def step(self, frame: SensorFrame) -> Command:
        """Run one tick."""

    def decide(self, tick: int) -> Command:
        """Run the last part of a tick that has been perceived already."""

    def take_events(self) -> list[OnboardEvent]:
        """Return and clear the events since the last call."""
