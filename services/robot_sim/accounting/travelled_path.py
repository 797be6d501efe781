"""Path of a trajectory up to the place that a robot has reached."""

from __future__ import annotations

from dataclasses import replace

from touchline.schemas.curves import Curve
from touchline.schemas.messages import Path, Segment, Trajectory
from touchline.services.robot_sim.paint.targets import segment_length_m


def travelled_path(trajectory: Trajectory, reached_m: float) -> Trajectory:
    """Return the path of a trajectory up to an arc length, without speeds.

    Args:
        trajectory: The trajectory.
        reached_m: Arc length along it.
    """
    driven, at_m = list[Segment](), 0.0
    for segment in trajectory.path.segments:
        if at_m >= reached_m:
            break
        length_m = segment_length_m(segment)
        if at_m + length_m > reached_m:
            part = replace(Curve.from_message(segment.curve), length_m=reached_m - at_m)
            segment = segment.model_copy(update={"curve": part.to_message()})  # noqa: PLW2901
        driven.append(segment)
        at_m += length_m
    return Trajectory(path=Path(segments=tuple(driven)))
