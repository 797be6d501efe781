"""Observer of a team on one side of a split network: appends what it hears to a file, a line of JSON a message.

`python -m tests.system.team_observer FILE NAMES`, until it is killed.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

from touchline.bus import Bus, BusConfig
from touchline.bus.health import STARTING
from touchline.coordination.reported_contacts import tick_of
from touchline.schemas import topics
from touchline.schemas.messages import DiagnosticArray, Message, TeamStatus, TrueWay


def line_of(name: str, message: Message) -> dict[str, object]:
    """Note about a message; none about most."""
    if isinstance(message, TrueWay):
        return {"way": name, "tick": tick_of(message), "x": list(message.x_m), "y": list(message.y_m)}
    if isinstance(message, TeamStatus):
        return {"arrived": message.arrived, "coordinator": message.coordinator, "problem": message.problem}
    if isinstance(message, DiagnosticArray) and message.status[0].name == topics.STANDBY:
        return {"standby": message.status[0].message}
    if isinstance(message, DiagnosticArray) and message.status[0].name == topics.ROBOT_SIM:
        return {} if message.status[0].message.startswith(STARTING) else {"ready": name}
    return {}


def main(file: Path, names: list[str]) -> None:
    config = BusConfig.from_environment((topics.TEAM_NAMESPACE,))
    with Bus.open(topics.OPERATOR, config, lambda: False) as bus, file.open("w") as out:  # the router may come later
        inboxes = {name: bus.of(name).inbox([topics.TRUE_WAY, topics.DIAGNOSTICS]) for name in names}
        inboxes[topics.TEAM_NAMESPACE] = bus.inbox([topics.TEAM_STATUS, topics.DIAGNOSTICS])
        while True:
            for name, inbox in inboxes.items():
                for _, message in inbox.messages():
                    if line := line_of(name, message):
                        out.write(json.dumps(line) + "\n")
            out.flush()
            time.sleep(0.05)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
