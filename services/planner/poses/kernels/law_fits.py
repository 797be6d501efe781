"""Compiled: check of a speed profile against the limits."""

from touchline.core.jit import kernel
from touchline.services.planner.drives.caps import Caps, gain
from touchline.services.planner.geometry.clothoid import Floats

# Change of a constant v² by rounding, which is no acceleration (m²/s²).
HELD = 1e-12


@kernel
def fits(length: Floats, curvature: Floats, sharpness: Floats, cap: Floats, square: Floats, limits: Caps) -> bool:
    """True if a drive with u = v² linear over each cell keeps the limits of `drives/caps.py`.

    Args:
        length: (n,) lengths of the cells (m).
        curvature: (n,) signed curvature at the beginning of each cell (1/m).
        sharpness: (n,) signed sharpness, constant over each cell (1/m²).
        cap: (n,) maximum u of each cell (m²/s²).
        square: (n + 1,) u at the borders of the cells (m²/s²).
        limits: Limits of drive and plan.
    """
    for i in range(len(length)):
        first, last = square[i], square[i + 1]
        if max(first, last) > cap[i]:
            return False
        if last > first + HELD:
            most = gain(first, curvature[i], sharpness[i], length[i], limits)
        elif first > last + HELD:
            most = gain(last, curvature[i] + sharpness[i] * length[i], -sharpness[i], length[i], limits)
        else:
            continue
        if abs(last - first) > 2.0 * most * length[i]:
            return False
    return True
