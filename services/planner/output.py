"""The Trajectory message: lines and arcs with ids, the speed profile and the actuation profile."""

from collections.abc import Sequence

from schemas.messages import (
    Actuation,
    ActuationProfile,
    LinearDirection,
    Path,
    PathActuationParameter,
    PathVelocityParameter,
    Segment,
    Trajectory,
    Velocity,
    VelocityProfile,
    VelocityType,
)
from services.planner.actuation import Switch
from services.planner.sending import Sent
from services.planner.timing import SpeedProfile


def trajectory_message(sent: Sequence[Sent], speeds: SpeedProfile, switches: Sequence[Switch]) -> Trajectory:
    """The Trajectory message."""
    forward, linear = LinearDirection(value=LinearDirection.FORWARD), VelocityType(value=VelocityType.LINEAR)
    return Trajectory(
        path=Path(
            segments=tuple(Segment(id=s.id, label=s.label, curve=s.curve.to_message(), direction=forward) for s in sent)
        ),
        actuation_profile=ActuationProfile(
            parameters=tuple(
                PathActuationParameter(arc_length=s.station_m, actuation=Actuation(value=s.mask)) for s in switches
            )
        ),
        velocity_profile=VelocityProfile(
            parameters=tuple(
                PathVelocityParameter(arc_length=station, velocity=Velocity(type=linear, value=speed))
                for station, speed in zip(speeds.station_m.tolist(), speeds.speed_mps.tolist(), strict=True)
            )
        ),
    )
