"""What every kind of tool has in a vehicle's file."""

from typing import TYPE_CHECKING, Any

from touchline.schemas.spec import Spec
from touchline.schemas.vehicles.drive_spec import DriveSpec
from touchline.schemas.vehicles.vehicle_body import VehicleBody


class ToolSpec(Spec):
    """Base of the tools: the kind's name and what plans ask of it. A kind is registered in `TOOLS`.

    Only the files of a kind read its own fields.
    """

    kind: str

    @property
    def point_m(self) -> tuple[float, float]:
        """What shall follow the line (x, y), in the body's frame."""
        raise NotImplementedError

    @property
    def work_speed_mps(self) -> float:
        """Planned speed while it works."""
        raise NotImplementedError

    def check(self, body: VehicleBody, drive: DriveSpec) -> None:
        """See whether it suits what carries and what drives it.

        Raises:
            ValidationError: It does not: a `misfit`.
        """

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """A field of the kind."""
