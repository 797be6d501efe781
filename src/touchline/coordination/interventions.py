"""Interventions: how much what keeps robots apart changes what they wish."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

CHANGED_MPS: Final = 1e-6
"""Change of speed or direction below which a wish is granted."""


class Interventions:
    """Interventions so far.

    Attributes:
        granted: Wishes that were granted unchanged.
        changed: Number of changed wishes, by robot.
    """

    def __init__(self) -> None:
        """Start without any."""
        self.granted = 0
        self.changed: Counter[str] = Counter()
        self._sum_mps = self._sum_radps = 0.0

    def note(self, names: Sequence[str], changes: Floats) -> None:
        """Take an update.

        Args:
            names: Names of n robots.
            changes: (n, 2) change of the wished velocity (m/s) and yaw rate (rad/s); 0: granted.
        """
        for name, (velocity_mps, rate_radps) in zip(names, changes.tolist(), strict=True):
            if abs(velocity_mps) <= CHANGED_MPS and abs(rate_radps) <= CHANGED_MPS:
                self.granted += 1
                continue
            self.changed[name] += 1
            self._sum_mps += abs(velocity_mps)
            self._sum_radps += abs(rate_radps)

    def figures(self) -> dict[str, Any]:
        """Return figures as a JSON object: means over all wishes."""
        wishes = self.granted + self.changed.total()
        return {
            "wishes": wishes,
            "changed_share": self.changed.total() / max(wishes, 1),
            "mean_change_mps": self._sum_mps / max(wishes, 1),
            "mean_change_radps": self._sum_radps / max(wishes, 1),
            "most_changed": dict(self.changed.most_common(5)),
        }
