"""Orders given automatically when the console opens, until one is refused."""

from __future__ import annotations

from dataclasses import dataclass, field

from touchline.schemas import topics
from touchline.tui.state import ConsoleState

NEEDS = {"plan": topics.PLANNER, "load": topics.ROBOT_SIM, "speed": topics.ROBOT_SIM, "start": topics.ROBOT_SIM}
"""Process that executes an order."""


@dataclass
class AutoStart:
    """Steps on opening: show a template, set a speed, and with `run` plan, load and start it, too."""

    template: str | None = None
    speed: float | None = None
    run: bool = False
    _steps: list[str] = field(init=False)
    _under_way: bool = field(init=False, default=False)

    def __post_init__(self) -> None:
        """Derive the steps."""
        self._steps = ["plan", "load"] if self.run else []
        self._steps += ["speed"] if self.speed is not None else []
        self._steps += ["start"] if self.run else []

    @property
    def under_way(self) -> bool:
        """True if steps remain."""
        return bool(self._steps)

    def due(self, state: ConsoleState) -> str | None:
        """Return the next order, which counts as given; None while one is under way or its process is absent."""
        if not self._steps or self._under_way or not state.nodes[NEEDS[self._steps[0]]].alive:
            return None
        self._under_way = True
        return self._steps[0]

    def done(self, name: str, ok: bool) -> None:
        """Process the outcome of an order; after a failure the operator takes over."""
        if self._under_way and self._steps and name == self._steps[0]:
            self._under_way = False
            self._steps = self._steps[1:] if ok else []

    def stop(self) -> None:
        """Drop all steps, as the operator takes over."""
        self._steps = []
