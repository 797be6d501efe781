"""Visitor that joins the bus, asks for the robot's diagnostics, and leaves.

`python -m benchmarks._visitor TIMES` prints the number of failures.
"""

from __future__ import annotations

import sys

import zenoh

from benchmarks._system import new_id
from touchline.bus import Bus
from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import GetDiagnosticsRequest


def main() -> None:
    """Visit the given number of times."""
    print(sum(not _visit() for _ in range(int(sys.argv[1]))))


def _visit() -> bool:
    """Visit once; true if there was an answer, and leaving succeeded."""
    try:
        with Bus.open(topics.OPERATOR) as bus:
            bus.call(topics.diagnostics_service(topics.ROBOT_SIM), GetDiagnosticsRequest(request_id=new_id()))
    except (TouchlineError, zenoh.ZError):
        return False
    return True


if __name__ == "__main__":
    main()
