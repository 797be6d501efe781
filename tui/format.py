"""Formatting of numbers for the operator; a dash stands for values that are unknown or not finite."""

from __future__ import annotations

import math

UNKNOWN = "–"


def number(value: float | None, digits: int = 1, unit: str = "") -> str:
    """Format a number with fixed digits and its unit."""
    if value is None or not math.isfinite(value):
        return UNKNOWN
    return f"{round(value, digits) + 0.0:.{digits}f}{' ' + unit if unit else ''}"  # + 0.0: no -0.0


def length(value_m: float | None) -> str:
    """Format a length with a suitable prefix: 4 mm, 62 cm, 12.0 m, 1.64 km."""
    if value_m is None or not math.isfinite(value_m):
        return UNKNOWN
    size = abs(value_m)
    if size < 0.0995:
        return f"{value_m * 1000:.0f} mm"
    if size < 0.995:
        return f"{value_m * 100:.0f} cm"
    return f"{value_m:.1f} m" if size < 999.5 else f"{value_m / 1000:.2f} km"


def round_length(value_m: float) -> str:
    """Format a round length: 5 cm, 20 m, 1 km."""
    if value_m < 0.995:
        return f"{value_m * 100:g} cm"
    return f"{value_m:g} m" if value_m < 999.5 else f"{value_m / 1000:g} km"


def duration(value_s: float | None) -> str:
    """Format a time span as m:ss or h:mm:ss."""
    if value_s is None or not math.isfinite(value_s):
        return UNKNOWN
    total = int(max(value_s, 0.0))
    hours, minutes, seconds = total // 3600, total // 60 % 60, total % 60
    return f"{hours}:{minutes:02}:{seconds:02}" if hours else f"{minutes}:{seconds:02}"


def percent(fraction: float | None, digits: int = 0) -> str:
    """Format a share 0…1 in per cent."""
    if fraction is None or not math.isfinite(fraction):
        return UNKNOWN
    return f"{100 * fraction:.{digits}f} %"


def factor(value: float | None) -> str:
    """Format a speed factor: 20×, max for a negative one, hold for 0."""
    if value is None or not math.isfinite(value):
        return UNKNOWN
    if value < 0:
        return "max"
    return "hold" if value == 0 else f"{value:.3g}×"


def cut(text: str, width: int) -> str:
    """Cut the middle of a name that is longer than `width` cells, as names differ most at their ends."""
    if len(text) <= width:
        return text
    if width < 2:
        return "…"[:width]
    end = max(width * 7 // 10, 1)
    return f"{text[: width - 1 - end]}…{text[-end:]}"


def cut_end(text: str, width: int) -> str:
    """Cut the end of a sentence that is longer than `width` cells."""
    return text if len(text) <= width else f"{text[: max(width - 1, 0)]}…"[:width]


def bar(fraction: float | None, width: int) -> tuple[str, str]:
    """Draw a horizontal bar in halves of a cell: (filled, rest), together `width` cells."""
    share = fraction if fraction is not None and math.isfinite(fraction) else 0.0
    full, half = divmod(math.floor(min(max(share, 0.0), 1.0) * width * 2 + 1e-9), 2)
    filled = "━" * full + ("╸" if half else "")
    return filled, "━" * (width - len(filled))
