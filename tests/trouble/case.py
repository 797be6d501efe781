"""Cases of the search for trouble: what is painted, in which world, and what the operator does; one JSON file each."""

from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import Field

from touchline.schemas.onboard import Follower
from touchline.schemas.scenario import Scenario
from touchline.schemas.spec import Spec, parse, read_text
from touchline.schemas.template import Template

OrderName = Literal[
    "pause", "resume", "abort", "estop", "reset", "link_lost", "fail_safe", "refill_tank", "goto", "kill"
]
FOUND: Final = Path(__file__).with_name("found")
"""Cases that have failed, each with the defect mended since."""
OPEN: Final = Path(__file__).with_name("open")
"""Cases that fail: defects that are known and not mended."""


class Order(Spec):
    """Order in a tick: of the operator, of the watchdog (`fail_safe`), or the death of the process (`kill`).

    After `goto` the robot drives 1 m straight ahead, after `kill` another process continues the job at once.
    """

    tick: Annotated[int, Field(ge=0)]
    name: OrderName


class Case(Spec):
    """A job, the world in which it is done, and the orders that nothing in the job calls for.

    A patient operator also resumes, resets and refills some seconds after the robot has stopped.
    """

    template: Template
    scenario: Scenario
    orders: tuple[Order, ...] = ()
    follower: Follower = "mpc"
    patient: bool = True

    def to_json(self) -> str:
        """The case as a file, without what is as by default."""
        return self.model_dump_json(indent=1, exclude_defaults=True) + "\n"

    def with_scenario(self, **parts: object) -> "Case":
        """The same case in another world."""
        return self.model_copy(update={"scenario": self.scenario.model_copy(update=parts)})


def load_case(path: Path) -> Case:
    """Read a case from its file."""
    return parse(Case, read_text(path), str(path))
