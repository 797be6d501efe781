"""Acceptance of the paint: it has to lie within the template's tolerance."""

from collections.abc import Sequence
from typing import Final, NamedTuple

from touchline.core.plain_sum import plain_sum
from touchline.services.robot_sim.paint.segment_metrics import SegmentMetrics

REQUIRED_PCT: Final = 99.0
"""Required share of the length of all lines together."""
LINE_REQUIRED_PCT: Final = 95.0
"""Required share of the length of every single line, ..."""
LACKS_M: Final = 0.05
"""... except for this length of a short one."""
VALVE_LACKS_M: Final = 0.005
"""Allowance for the valve at a line's ends; it decides for lines so short that it is more than `REQUIRED_PCT`
permits."""


class Verdict(NamedTuple):
    """Acceptance of paint, and the reason with its margin, in words."""

    accepted: bool
    text: str


def verdict(lines: Sequence[SegmentMetrics], within_pct: float, tolerance_m: float) -> Verdict:
    """Evaluate the paint.

    It is accepted if all lines together lack no more paint whose middle is within the tolerance than `100 −
    REQUIRED_PCT` of their length or, where that is less, `VALVE_LACKS_M` each; and if no single one lacks more than
    `100 − LINE_REQUIRED_PCT` of its own length or, where that is less, `LACKS_M`.

    Args:
        lines: Figures of the lines.
        within_pct: Share of the length of them all that has paint within the tolerance.
        tolerance_m: Tolerance of the template.
    """
    if not lines:
        return Verdict(True, "there are no lines to paint")
    length_m = plain_sum(line.length_m for line in lines)
    least_m = VALVE_LACKS_M * len(lines)
    allowed_m = max(least_m, (1.0 - REQUIRED_PCT / 100.0) * length_m)
    required = f"{REQUIRED_PCT:g} %" if allowed_m > least_m else f"all but {allowed_m:.3f} m of {length_m:.2f} m"
    near = f"{within_pct:.2f} % of the length is painted within {1e3 * tolerance_m:g} mm, {required} is asked for"
    worst = max(lines, key=lambda line: line.lacks_m - _allowed_m(line.length_m))
    line_m = _allowed_m(worst.length_m)
    single = f'the worst line, "{worst.id}", lacks {worst.lacks_m:.3f} m of it, {line_m:.3f} m is allowed'
    enough = (1.0 - within_pct / 100.0) * length_m <= allowed_m
    return Verdict(enough and worst.lacks_m <= line_m, f"{near}; {single}")


def _allowed_m(length_m: float) -> float:
    return max(LACKS_M, (1.0 - LINE_REQUIRED_PCT / 100.0) * length_m)
