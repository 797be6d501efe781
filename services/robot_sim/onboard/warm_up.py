"""Compiles (or loads from the cache) every kernel before the first real tick."""

from __future__ import annotations

from schemas.messages import (
    Actuation,
    ActuationProfile,
    Curve,
    CurveType,
    Line,
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
from schemas.scenario import Scenario
from schemas.vehicle import Vehicle
from services.robot_sim.frames import EncoderSample, GnssSample, ImuSample, MagSample, SensorFrame
from services.robot_sim.onboard.onboard import Onboard

_TICKS = 90


def warm_up(vehicle: Vehicle | None = None, scenario: Scenario | None = None) -> None:
    """Drive a throw-away robot off its mark once; takes seconds if nothing is cached, milliseconds if all is."""
    onboard = Onboard(vehicle or Vehicle(), scenario or Scenario())
    onboard.load(straight())
    onboard.start()
    for tick in range(1, _TICKS):
        fix = GnssSample((tick - 11) / 100, 0.0, 0.0, 1e-4, 3, 20, 0.0)
        fixes = (fix,) if tick % 10 == 1 and tick > 11 else ()
        imu, mag = ImuSample(0.0, 0.0, 0.0, 0.0, 0.0, 9.81), MagSample(0.0, 1.7e-5, -4.8e-5)
        onboard.step(SensorFrame(tick, tick / 100, imu, mag, EncoderSample(0.0, 0.0), fixes))


def straight() -> Trajectory:
    """A metre straight ahead, nothing sprayed."""
    line = Line(start=Point(x=0.0, y=0.0), end=Point(x=1.0, y=0.0))
    curve = Curve(type=CurveType(value=CurveType.LINE), line=(line,))
    speed = Velocity(type=VelocityType(value=VelocityType.LINEAR), value=0.5)
    return Trajectory(
        path=Path(segments=(Segment(id="w", curve=curve, direction=LinearDirection(value=LinearDirection.FORWARD)),)),
        actuation_profile=ActuationProfile(
            parameters=(PathActuationParameter(arc_length=0.0, actuation=Actuation(value=Actuation.NONE)),)
        ),
        velocity_profile=VelocityProfile(parameters=(PathVelocityParameter(arc_length=0.0, velocity=speed),)),
    )
