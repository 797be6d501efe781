"""First stroke of a route that begins at the machine's start pose."""

from collections.abc import Callable, Iterable, Iterator
from typing import Final

import numpy as np

from touchline.services.planner.coverage.cover_stroke import CoverStroke
from touchline.services.planner.coverage.coverage_route import DriveKind
from touchline.services.planner.coverage.free_space import FreeSpace
from touchline.services.planner.coverage.stroke_chain import StrokeChain
from touchline.services.planner.coverage.stroke_transition import ZONE_M
from touchline.services.planner.geometry.clothoid import PathPose

STEP_M: Final = 0.25
"""Resolution with which the free distance straight on is searched."""


def departures(start: PathPose, space: FreeSpace, *, reversing: bool) -> Iterator[CoverStroke]:
    """Straights ahead from the start pose, and back if it may reverse, each as long as there is room."""
    for direction in (1, -1) if reversing else (1,):
        longest = CoverStroke(DriveKind.SETTING_OUT, "setting out", start, ZONE_M, direction)
        for length_m in np.arange(ZONE_M, 0.0, -STEP_M).tolist():
            if not space.touched(longest.part(0.0, length_m)):
                yield CoverStroke(longest.kind, longest.label, start, length_m, direction)
                break
        else:
            yield CoverStroke(longest.kind, longest.label, start, 0.0, direction)


def set_out(
    chain: StrokeChain, offers: Iterable[CoverStroke], stroke: CoverStroke, vias: Callable[[], Iterable[CoverStroke]]
) -> bool:
    """Begin a chain with the departure from which a stroke is joined best; false if none leads to it.

    Args:
        chain: Empty chain.
        offers: Departures from the start pose.
        stroke: Stroke to join.
        vias: Returns short strokes over which it may be reached, once a departure is in the chain.
    """
    chain.forget_of(stroke)
    before, best = chain.state, None
    for offer in offers:
        chain.restore(before)
        chain.append(offer)
        if chain.append_over(stroke, vias()) and (best is None or chain.score_s < best[0]):
            best = chain.score_s, chain.state
    chain.restore(before if best is None else best[1])
    return best is not None
