"""A drum that makes the ground dense and smooth wherever it rolls."""

from typing import Literal

from touchline.schemas.misfit import misfit
from touchline.schemas.vehicles.drive_spec import DriveSpec
from touchline.schemas.vehicles.quantities import Length, Place, Speed
from touchline.schemas.vehicles.tool_spec import ToolSpec
from touchline.schemas.vehicles.vehicle_body import VehicleBody


class RollerTool(ToolSpec):
    """It puts nothing on the ground and has nothing to switch; it works at any speed, forward and backward."""

    kind: Literal["roller"] = "roller"
    """Works on its whole width wherever it rolls."""
    axle_x_m: Place = 0.0
    """Middle of the drum ahead of the frame's origin."""
    axle_y_m: Place = 0.0
    """Middle of the drum to the left."""
    rolled_width_m: Length = 2.2
    """Width of the strip that it rolls."""
    roll_speed_mps: Speed = 1.0
    """Highest planned speed while it works (study)."""

    @property
    def point_m(self) -> tuple[float, float]:
        """The middle of the drum."""
        return self.axle_x_m, self.axle_y_m

    @property
    def work_speed_mps(self) -> float:
        """At most."""
        return self.roll_speed_mps

    @property
    def width_m(self) -> float:
        """Of the strip that it rolls."""
        return self.rolled_width_m

    @property
    def steady_speed(self) -> bool:
        """Clay does not mind how fast."""
        return False

    @property
    def covers(self) -> bool:
        """That is all that it does."""
        return True

    def check(self, body: VehicleBody, drive: DriveSpec) -> None:
        """See whether the drive is fast enough.

        Raises:
            ValidationError: It is not.
        """
        if self.roll_speed_mps > drive.max_speed_mps:
            remedy = f"give at most {drive.max_speed_mps:.10g} m/s: {drive.says_no_more}"
            raise misfit("roll_speed_mps", self.roll_speed_mps, remedy)
