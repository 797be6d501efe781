"""Progress reports and deadline checks for long computations."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

# What is told the stage and the fraction of it that is done. It may raise, which ends the computation.
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Budget:
    """Of one computation: `step` is told the fraction done, `enough` says whether to stop early with what there is."""

    step: Callable[[float], None] = lambda fraction: None
    enough: Callable[[], bool] = lambda: False

    def parts(self, count: int, size: int, begun: float, ended: float) -> Iterator[slice]:
        """Slices of up to `size` items until the budget is used up; the fraction told rises from `begun` to `ended`."""
        for first in range(0, count, size):
            if self.enough():
                return
            last = min(first + size, count)
            yield slice(first, last)
            self.step(begun + (ended - begun) * last / count)


# Nobody waits.
UNWATCHED = Budget()
