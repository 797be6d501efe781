"""Check of robots that are to share a process."""

from collections.abc import Mapping
from pathlib import Path

from touchline.schemas.errors import SpecError
from touchline.schemas.plugins import ASKED
from touchline.schemas.setup import Setup


def check_together(robots: Mapping[str, Setup], journal: Path | None = None) -> None:
    """Check that robots can share a process; one alone always can.

    Args:
        robots: Setups by namespace.
        journal: File of a single robot's journal, or folder of their journals.

    Raises:
        SpecError: They cannot.
    """
    if len(robots) == 1:
        return
    if journal is not None and not journal.is_dir():
        remedy = "name a folder for theirs, or leave it out for that of the state ($XDG_STATE_HOME)"
        raise SpecError("command line", "--journal", f"is one file for {len(robots)} robots", remedy)
    for namespace, setup in robots.items():
        if setup.onboard.follower in ASKED:
            problem = f"is {setup.onboard.follower!r}, and for that follower the whole process would wait"
            remedy = "give each robot a process of its own (--apart), or this one another follower"
            raise SpecError(f"robot {namespace}", "onboard.follower", problem, remedy)
