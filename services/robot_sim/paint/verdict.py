"""Whether the paint is as the template asks: where it lies, within the template's tolerance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from touchline.services.robot_sim.paint.metrics import SegmentMetrics

REQUIRED_PCT: Final = 99.0
"""Of the length of all lines together."""
LINE_REQUIRED_PCT: Final = 95.0
"""Of the length of every single line, ..."""
LINE_LACKS_M: Final = 0.05
"""... but for that much of a short one."""


class Verdict(NamedTuple):
    """Whether paint is accepted, and the reason with its margin, in words."""

    accepted: bool
    text: str


def verdict(lines: Sequence[SegmentMetrics], within_pct: float, tolerance_m: float) -> Verdict:
    """Judge the paint.

    It is accepted if at least `REQUIRED_PCT` of the length of all lines has paint whose middle is within the tolerance,
    and no line lacks more of that than `100 − LINE_REQUIRED_PCT` of its length or, where that is less, `LINE_LACKS_M`.

    Args:
        lines: Their figures.
        within_pct: Share of the length of them all that has paint within the tolerance.
        tolerance_m: Of the template.
    """
    near = f"{within_pct:.2f} % of the length is painted within {1e3 * tolerance_m:g} mm"
    whole = f"{near}, {REQUIRED_PCT:g} % is asked for"
    if not lines:
        return Verdict(True, "there are no lines to paint")
    worst = max(lines, key=lambda line: line.lacks_m - _allowed_m(line.length_m))
    allowed_m = _allowed_m(worst.length_m)
    single = f'the worst line, "{worst.id}", lacks {worst.lacks_m:.3f} m of it, {allowed_m:.3f} m is allowed'
    return Verdict(within_pct >= REQUIRED_PCT and worst.lacks_m <= allowed_m, f"{whole}; {single}")


def _allowed_m(length_m: float) -> float:
    return max(LINE_LACKS_M, (1.0 - LINE_REQUIRED_PCT / 100.0) * length_m)
