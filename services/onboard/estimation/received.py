"""What a frame has of positions, whoever tells them, as records for kernels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from touchline.services.onboard.computer_state import ReceivedFix
from touchline.services.onboard.interface import CameraSample, SensorFrame

FIX_FIXED: Final = 3
_NONE: Final = ReceivedFix.row(0)


class ReceivedPosition(NamedTuple):
    """One of them; fields as in `ReceivedFix`."""

    stamp_s: float
    east_m: float
    north_m: float
    variance_m2: float
    fix: int
    satellites: int
    correction_age_s: float
    heading_rad: float = math.nan
    heading_variance_rad2: float = math.nan


def _of_camera(pose: CameraSample) -> ReceivedPosition:
    return ReceivedPosition(
        pose.stamp_s,
        pose.east_m,
        pose.north_m,
        pose.sigma_m**2,
        FIX_FIXED,
        0,
        0.0,
        pose.heading_rad,
        pose.sigma_rad**2,
    )


def received(frame: SensorFrame) -> list[ReceivedPosition]:
    """The fixes and poses that arrived with a frame, in the order of their arrival; a pose counts as fixed."""
    return [ReceivedPosition(*fix) for fix in frame.gnss] + [_of_camera(pose) for pose in frame.camera]


def as_records(positions: list[ReceivedPosition]) -> Sequence[ReceivedFix]:
    """(n,) of them, for kernels."""
    return np.array(positions, ReceivedFix.dtype) if positions else _NONE  # type: ignore[return-value]
