"""What a team is told to do: spread over the area, drive to lists of goals, or change places across a circle."""

from collections.abc import Mapping, Sequence
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from touchline.services.fleet.density import Density
from touchline.services.fleet.free_area import FreeArea
from touchline.services.fleet.lloyd import EVEN, deployment, relaxed_targets

Floats = NDArray[np.float64]

ARRIVED_M: Final = 0.1


class TeamTask(Protocol):
    """Goals for robots, from where they are."""

    def goals(self, names: Sequence[str], places: Floats) -> Floats:
        """Where each wants to be; to be asked once an update.

        Args:
            names: Of n robots.
            places: (n, 2) where they are (m).

        Returns:
            (n, 2) m; not necessarily within reach.
        """
        ...


class Deploy:
    """Spread over the area, by Lloyd's rule."""

    def __init__(self, area: FreeArea, density: Density = EVEN) -> None:
        """Over an area, by a density φ."""
        self._area, self._density = area, density

    def goals(self, names: Sequence[str], places: Floats) -> Floats:
        """See `TeamTask`.

        Raises:
            CoincidentPoints: Two robots are at the same place.
        """
        return relaxed_targets(places, deployment(places, self._area, self._density).centroids)


class GoalLists:
    """Each robot drives to its goals in turn, and stays at the last; one that has none stays where it is."""

    def __init__(self, goals: Mapping[str, Sequence[tuple[float, float]]]) -> None:
        """With the goals (m) of each robot by its name."""
        self._left = {name: list(places) for name, places in goals.items()}

    def goals(self, names: Sequence[str], places: Floats) -> Floats:
        """See `TeamTask`."""
        return np.array([self._goal(name, place) for name, place in zip(names, places, strict=True)]).reshape(-1, 2)

    def _goal(self, name: str, place: Floats) -> Floats:
        left = self._left.get(name)
        if not left:
            return place
        while len(left) > 1 and np.hypot(*(np.array(left[0]) - place)) <= ARRIVED_M:
            left.pop(0)
        return np.array(left[0])


def swap(places: Mapping[str, tuple[float, float]]) -> GoalLists:
    """Everybody to the opposite place, across the middle of all.

    Args:
        places: Where each robot is, by its name (m).
    """
    x, y = np.array([places[name] for name in sorted(places)]).mean(axis=0)
    return GoalLists({name: [(2.0 * x - at[0], 2.0 * y - at[1])] for name, at in places.items()})
