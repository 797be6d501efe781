"""Trajectory message: lines and arcs with ids, speed profile and actuation profile."""

from collections.abc import Iterator, Sequence

from touchline.schemas.messages import PathVelocityParameter, Segment, Trajectory, VelocityType
from touchline.schemas.trajectories import assemble, segment, turn, velocity
from touchline.services.planner.segments.sent_segments import Sent
from touchline.services.planner.speed.actuation import Switch
from touchline.services.planner.speed.timing import STATION_TOLERANCE_M, SpeedProfile


def trajectory_message(sent: Sequence[Sent], speeds: SpeedProfile, switches: Sequence[Switch]) -> Trajectory:
    """Create the Trajectory message.

    A turn on the spot is an ARC about its own start, of direction NONE, with the entries LINEAR 0, ANGULAR (its maximum
    rate, rad/s, left positive) and LINEAR 0 at its arc length.
    """
    return assemble(map(segment_of, sent), switches, _velocities(speeds))


def segment_of(sent: Sent) -> Segment:
    """Create the message of a line, an arc or a turn on the spot."""
    if sent.spin_rad:
        return turn(sent.id, sent.curve.x_m, sent.curve.y_m, sent.spin_rad, sent.label)
    return segment(sent.id, sent.curve, sent.direction, sent.label)


def _velocities(speeds: SpeedProfile) -> Iterator[PathVelocityParameter]:
    spins = list(speeds.spins)
    for station, speed in zip(speeds.station_m.tolist(), speeds.speed_mps.tolist(), strict=True):
        yield velocity(station, speed)
        while spins and spins[0].station_m <= station + STATION_TOLERANCE_M:
            yield velocity(station, spins.pop(0).rate_radps, VelocityType.ANGULAR)
            yield velocity(station, 0.0)
