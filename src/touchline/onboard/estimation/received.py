"""Positions that arrive with a frame, of a GNSS receiver or a camera, as records for the filter."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from touchline.core.records import RecordArray
from touchline.onboard.computer_state import ReceivedFix
from touchline.onboard.estimation.aiding.camera_aiding import fix_of
from touchline.onboard.interface import SensorFrame

_NONE: Final = RecordArray(ReceivedFix, np.zeros(0, ReceivedFix.dtype))


def received(frame: SensorFrame) -> RecordArray[ReceivedFix]:
    """Return the fixes and poses that arrived with a frame, in the order of their arrival."""
    if not frame.gnss and not frame.camera:
        return _NONE
    fixes: list[Any] = [(*fix, math.nan, math.nan) for fix in frame.gnss]
    fixes += map(fix_of, frame.camera)
    return RecordArray(ReceivedFix, np.array(fixes, ReceivedFix.dtype))
