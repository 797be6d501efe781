"""A nozzle that paints lines, with its valve, its discs and its tank."""

from typing import Annotated, Literal

from pydantic import Field

from touchline.schemas.misfit import misfit
from touchline.schemas.vehicles.drive_spec import DriveSpec
from touchline.schemas.vehicles.quantities import Delay, Length, Mass, Place, Speed
from touchline.schemas.vehicles.tool_spec import ToolSpec
from touchline.schemas.vehicles.vehicle_body import VehicleBody


class SprayerTool(ToolSpec):
    """Paints at one speed; the body's mass is that of the vehicle without paint."""

    kind: Literal["sprayer"] = "sprayer"
    """A nozzle that paints lines."""
    nozzle_x_m: Place = 0.0
    """Nozzle ahead of the axle."""
    nozzle_y_m: Place = -0.41124
    """Nozzle to the left; the shipped one is to the right."""
    spray_width_m: Length = 0.12
    """Width of a painted line."""
    paint_speed_mps: Speed = 1.0
    """Speed while painting; a plan's option can ask for another."""
    paint_l_per_m: Annotated[float, Field(gt=0, le=10)] = 0.0077
    """Paint for a metre of line at `paint_speed_mps`.

    20 L make about one American football field (2.6 km of line).
    """
    tank_l: Annotated[float, Field(gt=0, le=10_000)] = 20.0
    """Paint in a full tank."""
    mass_full_kg: Mass = 100.0
    """Mass of the whole robot with a full tank."""
    valve_on_delay_s: Delay = 0.015
    """Delay from command to paint."""
    valve_off_delay_s: Delay = 0.030
    """Delay from command to no paint."""
    disc_delay_s: Delay = 0.5
    """Time to lower or lift the discs."""
    drying_time_s: Annotated[float, Field(gt=0, le=1_000_000)] = 900.0
    """Time for which wheels and casters smear the paint.

    The no-pick-up time of ASTM D711, on grass.
    """
    smear_share: Annotated[float, Field(ge=0, le=1)] = 0.5
    """Share of fresh paint that sticks to a tread that rolls over it; 0: none."""
    smear_length_m: Annotated[float, Field(gt=0, le=100)] = 1.0
    """Distance over which the paint on a tread falls to 1/e."""

    @property
    def point_m(self) -> tuple[float, float]:
        """The nozzle's place."""
        return self.nozzle_x_m, self.nozzle_y_m

    @property
    def work_speed_mps(self) -> float:
        """That of painting."""
        return self.paint_speed_mps

    @property
    def flow_lps(self) -> float:
        """The pump's: that of a line painted at the tool's own speed."""
        return self.paint_l_per_m * self.paint_speed_mps

    @property
    def capacity_l(self) -> float:
        """That of the tank."""
        return self.tank_l

    @property
    def width_m(self) -> float:
        """That of a stroke."""
        return self.spray_width_m

    @property
    def drying_s(self) -> float:
        """Until wheels take up no paint any more."""
        return self.drying_time_s

    @property
    def opens_s(self) -> float:
        """The valve's delay."""
        return self.valve_on_delay_s

    @property
    def closes_s(self) -> float:
        """The valve's delay."""
        return self.valve_off_delay_s

    @property
    def lowers_s(self) -> float:
        """The discs' delay."""
        return self.disc_delay_s

    def full_kg(self, _body: VehicleBody) -> float:
        """With a full tank."""
        return self.mass_full_kg

    def check(self, body: VehicleBody, drive: DriveSpec) -> None:
        """See whether paint weighs something and the drive is fast enough.

        Raises:
            ValidationError: The full vehicle is lighter than the empty one, or paints faster than it drives.
        """
        if self.mass_full_kg < body.mass_empty_kg:
            raise misfit(
                "mass_full_kg", self.mass_full_kg, f"give at least {body.mass_empty_kg:g} kg, the mass_empty_kg"
            )
        if self.paint_speed_mps > drive.max_speed_mps:
            remedy = f"give at most {drive.max_speed_mps:.10g} m/s: {drive.says_no_more}"
            raise misfit("paint_speed_mps", self.paint_speed_mps, remedy)
