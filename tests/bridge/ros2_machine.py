"""A ROS 2 machine: message definitions, and a client, which here is other people's."""

import json
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
_ANSWER_S = 100.0


class ForeignClient:
    """The other end of ``foreign_client.py``."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process

    def do(self, what: str, **more: Any) -> Any:
        """One request and its answer."""
        assert self._process.stdin and self._process.stdout
        self._process.stdin.write(json.dumps({"do": what, **more}) + "\n")
        self._process.stdin.flush()
        overdue = threading.Timer(_ANSWER_S, self._process.kill)
        overdue.start()
        line = self._process.stdout.readline()
        overdue.cancel()
        assert line, "the foreign client ended"
        return json.loads(line)


@contextmanager
def foreign_client(definitions: Path, port: int, domain: int) -> Iterator[ForeignClient]:
    """A foreign client, ended with the context. It finds nothing of ours to import, and no network but loopback."""
    options = ["--port", str(port), "--domain", str(domain), "--definitions", str(definitions)]
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith(("PYTHONPATH", "TOUCHLINE"))
    }
    process = subprocess.Popen(
        [sys.executable, "-P", str(HERE / "foreign_client.py"), *options],
        cwd=definitions,
        env={**environment, "GIT_PYTHON_REFRESH": "quiet", "GIT_ALLOW_PROTOCOL": "none", "PYTHONWARNINGS": "ignore"},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        yield ForeignClient(process)
    finally:
        process.kill()
        process.communicate()
