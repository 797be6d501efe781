"""How much of a drawing is kept, all of it from one figure: the smallest feature that a painted line can show."""

from dataclasses import dataclass
from typing import Self

from touchline.schemas.template import MIN_LENGTH_M

#: How far a smooth curve may be from the drawing: as a share of the detail, and at least, m. A tenth of a line's width
#: is less than paint spreads in grass, and no more than the robot itself strays.
TOLERANCE_SHARE, FINEST_M = 0.1, 1e-3
#: How far what is smaller than the detail may give way: a quarter of it. The painted line still covers where it was.
STRAY_SHARE = 0.25


@dataclass(frozen=True)
class Detail:
    """What is kept of a drawing, m.

    Attributes:
        feature_m: Lines, arcs, gaps and steps below this give way; 0: only what a template cannot hold does.
        tolerance_m: How far the template's lines and arcs may be from the drawing's curves, and these from them.
        stray_m: The same where something smaller than ``feature_m`` gives way.
    """

    feature_m: float
    tolerance_m: float
    stray_m: float

    @classmethod
    def of(cls, feature_m: float) -> Self:
        """The tolerances for a smallest feature, m; below a template's shortest line all detail is kept."""
        if feature_m <= MIN_LENGTH_M:
            return cls(0.0, FINEST_M, MIN_LENGTH_M / 2)
        return cls(feature_m, max(TOLERANCE_SHARE * feature_m, FINEST_M), max(STRAY_SHARE * feature_m, FINEST_M))
