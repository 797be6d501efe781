"""What the emulator needs of the robot's own computer."""

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
        """Where it believes the robot is."""

    @property
    def status(self) -> Status:
        """Where the traversal stands."""

    @property
    def state(self) -> int:
        """The state of `status`."""

    @property
    def warning(self) -> MoveOffWarning | None:
        """The warning that it gives before and while the robot moves."""

    @property
    def consistency(self) -> Consistency:
        """How consistent the estimate is."""

    @property
    def lateral_error_m(self) -> float:
        """How far it believes the nozzle is to the left of its path."""

    @property
    def spraying(self) -> bool:
        """Whether it commands the valve open."""

    @property
    def painted(self) -> PaintBelief:
        """What it believes it has painted."""

    @property
    def aligned(self) -> bool:
        """Whether it knows where it stands well enough to drive off."""

    @property
    def checkpoint(self) -> Checkpoint | None:
        """Where another process could go on."""

    def check_load(self) -> None:
        """Whether a trajectory would be taken now."""

    def prepare(self, trajectory: Trajectory, boundary: Sequence[tuple[float, float]] = ()) -> Any:
        """Check a trajectory, not to be left beyond the boundary; changes nothing."""

    def take(self, course: Any, resume: Checkpoint | None = None) -> float:
        """Take what `prepare` gave; returns its planned duration [s]."""

    def take_here(self, course: Any) -> float:
        """As `take`, if it begins where the robot stands."""

    def take_over(self, course: Any) -> float:
        """As `take`, under way and without a stop."""

    def begin_guided(self) -> None:
        """Drive where a coordinator guides the robot from now on."""

    def take_guidance(self, told: Guidance) -> bool:
        """Take what the coordinator tells; False if it cannot be used, or the robot is not guided."""

    @property
    def guided(self) -> bool:
        """Whether a coordinator guides the robot, emergency-stopped or not."""

    @property
    def whereabouts(self) -> Whereabouts | None:
        """What a guided robot tells its coordinator; None if it is not guided."""

    def start(self) -> None:
        """Begin the traversal."""

    def pause(self, reason: str = PAUSED_BY_OPERATOR, by: Pause = BY_OPERATOR) -> None:
        """Brake and close the valve."""

    def resume(self) -> None:
        """Go on after a pause."""

    def abort(self, reason: str = ABORTED_BY_OPERATOR) -> None:
        """Brake and give the traversal up."""

    def estop(self, reason: str = EMERGENCY_STOP) -> None:
        """Stop at once and latch."""

    def reset(self) -> None:
        """Release the latch."""

    def authorize(self, until_m: float) -> None:
        """Drive up to this arc length only [m], and on when it is moved on."""

    def link_lost(self) -> None:
        """The operator cannot be heard any more: pause if under way."""

    def take_samples(self, samples: Sequence[AuxiliarySample]) -> None:
        """Use what auxiliary sensors have measured."""

    def step(self, frame: SensorFrame) -> Command:
        """One tick."""

    def decide(self, tick: int) -> Command:
        """The last part of a tick that has been perceived already."""

    def take_events(self) -> list[OnboardEvent]:
        """Events since the last call."""
