"""Progress reports and deadline checks for long computations."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

# Called with the stage and the fraction of it that is done; may raise to end the computation.
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Budget:
    """Budget of a computation: `step` takes the fraction done, `enough` returns whether to stop early."""

    step: Callable[[float], None] = lambda fraction: None
    enough: Callable[[], bool] = lambda: False

    def parts(self, count: int, size: int, begun: float, ended: float) -> Iterator[slice]:
        """Slices of up to `size` items until `enough`; the reported fraction rises from `begun` to `ended`."""
        for first in range(0, count, size):
            if self.enough():
                return
            last = min(first + size, count)
            yield slice(first, last)
            self.step(begun + (ended - begun) * last / count)


# Budget without progress reports or deadline.
UNWATCHED = Budget()
