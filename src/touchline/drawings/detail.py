"""Level of detail of an import, derived from the smallest feature that a painted line can show."""

from dataclasses import dataclass
from typing import Self

from touchline.schemas.template import MIN_LENGTH_M

#: Tolerance of smooth curves: fraction of the detail, and minimum, m. A tenth of a line's width is less than paint
#: spreads in grass, and no more than the robot itself strays.
TOLERANCE_SHARE, FINEST_M = 0.1, 1e-3
#: Tolerance for features smaller than the detail, as a fraction of it; the painted line still covers them.
STRAY_SHARE = 0.25


@dataclass(frozen=True)
class Detail:
    """Tolerances of an import, m.

    Attributes:
        feature_m: Size of lines, arcs, gaps and steps below which they are dropped; 0: only if a template cannot hold
            them.
        tolerance_m: Maximum distance between the template's lines and arcs and the drawing's curves.
        stray_m: The same where a feature smaller than ``feature_m`` is dropped.
    """

    feature_m: float
    tolerance_m: float
    stray_m: float

    @classmethod
    def of(cls, feature_m: float) -> Self:
        """Derive the tolerances from a smallest feature, m; below a template's shortest line all detail is kept."""
        if feature_m <= MIN_LENGTH_M:
            return cls(0.0, FINEST_M, MIN_LENGTH_M / 2)
        return cls(feature_m, max(TOLERANCE_SHARE * feature_m, FINEST_M), max(STRAY_SHARE * feature_m, FINEST_M))
