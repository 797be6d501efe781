"""No tool: a vehicle that drives along lines and leaves nothing on them."""

from typing import Literal

from touchline.schemas.misfit import misfit
from touchline.schemas.vehicles.drive_spec import DriveSpec
from touchline.schemas.vehicles.quantities import Place, Speed
from touchline.schemas.vehicles.tool_spec import ToolSpec
from touchline.schemas.vehicles.vehicle_body import VehicleBody


class NoTool(ToolSpec):
    """A point of the body that follows lines: that of a camera, say, or the body's origin."""

    kind: Literal["none"] = "none"
    """Follows lines and leaves nothing on them."""
    point_x_m: Place = 0.0
    """Point that follows lines, ahead of the origin."""
    point_y_m: Place = 0.0
    """The same point, to the left."""
    line_speed_mps: Speed = 1.0
    """Planned speed along lines."""

    @property
    def point_m(self) -> tuple[float, float]:
        """The place of the point."""
        return self.point_x_m, self.point_y_m

    @property
    def work_speed_mps(self) -> float:
        """That along lines."""
        return self.line_speed_mps

    def check(self, body: VehicleBody, drive: DriveSpec) -> None:
        """See whether the drive is fast enough.

        Raises:
            ValidationError: It is not.
        """
        if self.line_speed_mps > drive.max_speed_mps:
            remedy = f"give at most {drive.max_speed_mps:.10g} m/s: {drive.says_no_more}"
            raise misfit("line_speed_mps", self.line_speed_mps, remedy)
