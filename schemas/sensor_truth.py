"""Base class of what a scenario says about the auxiliary sensors of one kind."""

from typing import TYPE_CHECKING, Any

from touchline.schemas.spec import Spec


class SensorTruth(Spec):
    """Errors of the emulated sensors of a kind, and what there is for them to measure; unknown to the robot.

    Each kind adds fields, all with defaults; those of `SENSORS` name the class.
    """

    kind: str

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """A field of the kind."""
