"""Base class of drives in a vehicle's file."""

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

from pydantic import Field, model_validator

from touchline.schemas.misfit import misfit
from touchline.schemas.spec import Spec
from touchline.schemas.vehicles.actuator import Actuator
from touchline.schemas.vehicles.ground_contact import GroundContact
from touchline.schemas.vehicles.quantities import Acceleration, Speed


class DriveSpec(Spec):
    """Base of the drives: the kind's name and what plans ask of it. A kind is registered in `DRIVES`.

    Each kind adds fields and fills in the three properties. Only the files of that kind read its own fields.
    """

    kind: str
    """Kind of drive."""
    transit_speed_mps: Speed = 1.4
    """Planned speed where nothing is worked on."""
    max_acceleration_mps2: Acceleration = 1.0
    """Planned acceleration along the path.

    A full tank and grass bear it without slipping or slopping.
    """
    max_lateral_acceleration_mps2: Acceleration = 1.2
    """Planned acceleration across the path.

    Tyres on grass bear it with hardly any slip. (The study's 1.5 m/s in turns of 1.125 1/m need 2.53 m/s², at which the
    emulated robot slides.)
    """
    default_kappa_max_1pm: Annotated[float, Field(gt=0, le=100)] = 1.125
    """Largest curvature of `ccd` and `dubins-padded`."""
    default_sigma_max_1pm2: Annotated[float, Field(gt=0, le=1_000)] = 2.1
    """Largest sharpness of `ccd` and `dubins-padded`."""
    can_reverse: bool = True
    """Plans may drive backward."""
    can_spin: bool = False
    """Plans may turn on the spot."""

    says_no_more: ClassVar[str] = "the drive does no more"
    """Reason why no speed may be above `max_speed_mps`, for a remedy."""

    @property
    def max_speed_mps(self) -> float:
        """The largest speed straight ahead."""
        raise NotImplementedError

    @property
    def actuators(self) -> tuple[Actuator, ...]:
        """Actuators, in the order of commands."""
        raise NotImplementedError

    def steering_rad(self, speed_mps: float, yaw_rate_radps: float) -> float | None:
        """At which angle a wheel is steered while the vehicle moves so; None: none is. Left positive."""
        return None

    @property
    def contacts(self) -> tuple[GroundContact, ...]:
        """Contacts with the ground."""
        raise NotImplementedError

    @property
    def contacts_m(self) -> tuple[tuple[float, float], ...]:
        """Their places (x, y), in the body's frame."""
        return tuple((contact.x_m, contact.y_m) for contact in self.contacts)

    @model_validator(mode="after")
    def _transit_fits(self) -> Self:
        if self.transit_speed_mps > self.max_speed_mps:
            remedy = f"give at most {self.max_speed_mps:.10g} m/s: {self.says_no_more}"
            raise misfit("transit_speed_mps", self.transit_speed_mps, remedy)
        return self

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """A field of the kind."""
