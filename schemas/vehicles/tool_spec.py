"""Base class of tools in a vehicle's file."""

from typing import TYPE_CHECKING, Any

from touchline.schemas.spec import Spec
from touchline.schemas.vehicles.drive_spec import DriveSpec
from touchline.schemas.vehicles.vehicle_body import VehicleBody


class ToolSpec(Spec):
    """Base of the tools: the kind's name and what is asked of each. A kind is registered in `TOOLS`.

    Only the files of a kind read its own fields. What has a value here is for tools that put something on the ground:
    one that does not leaves it as it is.
    """

    kind: str

    @property
    def point_m(self) -> tuple[float, float]:
        """Point that follows the line (x, y), in the body's frame."""
        raise NotImplementedError

    @property
    def work_speed_mps(self) -> float:
        """Planned speed while it works."""
        raise NotImplementedError

    @property
    def flow_lps(self) -> float:
        """Consumption while it works [l/s]; 0: it puts nothing on the ground."""
        return 0.0

    @property
    def paints(self) -> bool:
        """True if it puts anything on the ground."""
        return self.flow_lps > 0.0

    @property
    def capacity_l(self) -> float:
        """Volume of its tank."""
        return 0.0

    @property
    def width_m(self) -> float:
        """Of the strip that it works on."""
        return 0.0

    @property
    def steady_speed(self) -> bool:
        """True if it needs one speed along a line; else it may brake, and begin and end at a standstill."""
        return True

    @property
    def covers(self) -> bool:
        """True if it works on areas: on all ground that it passes, leaving nothing there."""
        return False

    @property
    def drying_s(self) -> float:
        """Time for which its work must not be rolled over."""
        return 0.0

    @property
    def opens_s(self) -> float:
        """Time before a line's start at which it is switched on."""
        return 0.0

    @property
    def closes_s(self) -> float:
        """Time before a line's end at which it is switched off."""
        return 0.0

    @property
    def lowers_s(self) -> float:
        """Time before a line's start at which it is lowered."""
        return 0.0

    def full_kg(self, body: VehicleBody) -> float:
        """Mass of the whole vehicle with all that it can carry."""
        return body.mass_empty_kg

    def check(self, body: VehicleBody, drive: DriveSpec) -> None:
        """See whether it suits what carries and what drives it.

        Raises:
            ValidationError: It does not: a `misfit`.
        """

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """A field of the kind."""
