"""Trajectory messages put together from curves and plain numbers."""

from collections.abc import Iterable

from touchline.schemas.curves import Curve
from touchline.schemas.messages import (
    Actuation,
    ActuationProfile,
    Arc,
    CurveMessage,
    CurveType,
    LinearDirection,
    Path,
    PathActuationParameter,
    PathVelocityParameter,
    Point,
    Segment,
    Trajectory,
    Velocity,
    VelocityProfile,
    VelocityType,
)


def segment(name: str, curve: Curve, direction: int = LinearDirection.FORWARD, label: str = "") -> Segment:
    """The segment with the id ``name`` along ``curve``, which is as travelled."""
    return Segment(id=name, label=label, curve=curve.to_message(), direction=LinearDirection(value=direction))


def turn(name: str, x_m: float, y_m: float, angle_rad: float, label: str = "") -> Segment:
    """A turn on the spot (left positive): an ARC about its own start, of direction NONE."""
    point = Point(x=x_m, y=y_m)
    arc = Arc(start=point, center=point, sweep_angle=angle_rad)
    return Segment(id=name, label=label, curve=CurveMessage(type=CurveType(value=CurveType.ARC), arc=(arc,)))


def velocity(arc_length_m: float, value: float, kind: int = VelocityType.LINEAR) -> PathVelocityParameter:
    """The entry of a velocity profile: m/s, or rad/s for an ANGULAR one."""
    return PathVelocityParameter(arc_length=arc_length_m, velocity=Velocity(type=VelocityType(value=kind), value=value))


def assemble(
    segments: Iterable[Segment], switches: Iterable[tuple[float, int]], velocities: Iterable[PathVelocityParameter]
) -> Trajectory:
    """The trajectory of these segments; a switch is an arc length (m) and the actuation from there on."""
    return Trajectory(
        path=Path(segments=tuple(segments)),
        actuation_profile=ActuationProfile(
            parameters=tuple(
                PathActuationParameter(arc_length=arc_length_m, actuation=Actuation(value=mask))
                for arc_length_m, mask in switches
            )
        ),
        velocity_profile=VelocityProfile(parameters=tuple(velocities)),
    )
