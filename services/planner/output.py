"""The Trajectory message: lines and arcs with ids, the speed profile and the actuation profile."""

from collections.abc import Iterator, Sequence

from schemas.messages import (
    Actuation,
    ActuationProfile,
    Arc,
    Curve,
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
from services.planner.actuation import Switch
from services.planner.sending import Sent
from services.planner.timing import STATION_TOLERANCE_M, SpeedProfile


def trajectory_message(sent: Sequence[Sent], speeds: SpeedProfile, switches: Sequence[Switch]) -> Trajectory:
    """The Trajectory message.

    A turn on the spot is an ARC about its own start, of direction NONE, with the entries LINEAR 0, ANGULAR (its largest
    rate, rad/s, left positive) and LINEAR 0 at its arc length.
    """
    return Trajectory(
        path=Path(segments=tuple(_segment(s) for s in sent)),
        actuation_profile=ActuationProfile(
            parameters=tuple(
                PathActuationParameter(arc_length=s.station_m, actuation=Actuation(value=s.mask)) for s in switches
            )
        ),
        velocity_profile=VelocityProfile(parameters=tuple(_velocities(speeds))),
    )


def _segment(sent: Sent) -> Segment:
    if sent.spin_rad:
        point = Point(x=sent.curve.x_m, y=sent.curve.y_m)
        arc = Arc(start=point, center=point, sweep_angle=sent.spin_rad)
        curve = Curve(type=CurveType(value=CurveType.ARC), arc=(arc,))
    else:
        curve = sent.curve.to_message()
    return Segment(id=sent.id, label=sent.label, curve=curve, direction=LinearDirection(value=sent.direction))


def _velocities(speeds: SpeedProfile) -> Iterator[PathVelocityParameter]:
    linear, angular = (VelocityType(value=kind) for kind in (VelocityType.LINEAR, VelocityType.ANGULAR))
    spins = list(speeds.spins)
    for station, speed in zip(speeds.station_m.tolist(), speeds.speed_mps.tolist(), strict=True):
        yield PathVelocityParameter(arc_length=station, velocity=Velocity(type=linear, value=speed))
        while spins and spins[0].station_m <= station + STATION_TOLERANCE_M:
            rate = spins.pop(0).rate_radps
            yield PathVelocityParameter(arc_length=station, velocity=Velocity(type=angular, value=rate))
            yield PathVelocityParameter(arc_length=station, velocity=Velocity(type=linear, value=0.0))
