"""What a frame has of positions, whoever tells them, as records."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from touchline.core.records import RecordArray
from touchline.onboard.computer_state import ReceivedFix
from touchline.onboard.interface import CameraSample, SensorFrame

FIX_FIXED: Final = 3
_NONE: Final = RecordArray(ReceivedFix, np.zeros(0, ReceivedFix.dtype))


def received(frame: SensorFrame) -> RecordArray[ReceivedFix]:
    """The fixes and poses that arrived with a frame, in the order of their arrival."""
    if not frame.gnss and not frame.camera:
        return _NONE
    fixes: list[Any] = [(*fix, math.nan, math.nan) for fix in frame.gnss]
    fixes += [_of_camera(pose) for pose in frame.camera]
    return RecordArray(ReceivedFix, np.array(fixes, ReceivedFix.dtype))


def _of_camera(pose: CameraSample) -> tuple[float, ...]:
    """The fields of `ReceivedFix`; a pose counts as fixed."""
    position = pose.stamp_s, pose.east_m, pose.north_m, pose.sigma_m**2
    return *position, FIX_FIXED, 0, 0.0, pose.heading_rad, pose.sigma_rad**2
