"""Orders given automatically when the console opens, until one is refused."""

from __future__ import annotations

from dataclasses import dataclass, field

from touchline.schemas import topics
from touchline.tui import supply_check
from touchline.tui.event_log import WARN
from touchline.tui.operator import Operator
from touchline.tui.unfinished_job import name_of, offered, share_done

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

    def go_on(self, operator: Operator) -> None:
        """Give the next order, unless one is under way or its process is absent."""
        state = operator.state
        if not self._steps or self._under_way or not state.nodes[NEEDS[self._steps[0]]].alive:
            return
        self._under_way = True
        match self._steps[0]:
            case "plan":
                if operator.may_prepare("Start", needs_template=True):
                    operator.plan(operator.options)
                else:
                    self.stop()
            case "load":
                if (job := offered(state)) is None:
                    operator.load()
                else:
                    self.stop()
                    text = f"{name_of(job)} is {share_done(state, job)}: g goes on with it, l loads the plan anew"
                    state.say(WARN, text)
            case "speed" if self.speed is not None:
                operator.set_speed(self.speed)
            case "start":
                for shortage in supply_check.of_job(state).shortages:
                    state.note(WARN, "console", f"the job {shortage}")
                operator.command("start")

    def done(self, name: str, ok: bool) -> None:
        """Process the outcome of an order; after a failure the operator takes over."""
        if self._under_way and self._steps and name == self._steps[0]:
            self._under_way = False
            self._steps = self._steps[1:] if ok else []

    def stop(self) -> None:
        """Drop all steps, as the operator takes over."""
        self._steps = []
