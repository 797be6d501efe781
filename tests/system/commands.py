"""Running the command as a person does."""

import io
import json
import os
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any
from unittest import mock

from touchline.bus import BusConfig
from touchline.cli.commands import execute


def touchline(
    *arguments: str, config: BusConfig | None = None, cwd: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """``touchline ARGUMENTS`` to its end."""
    environment = {**os.environ, **(config.environment() if config else {}), "COLUMNS": "120"}
    return subprocess.run(
        [sys.executable, "-m", "touchline", *arguments],
        env=environment,
        cwd=cwd,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=500,
        check=False,
    )


def touchline_here(*arguments: str, config: BusConfig | None = None) -> subprocess.CompletedProcess[str]:
    """As `touchline`, in this process: to start one takes a second of processor time."""
    environment = {**(config.environment() if config else {}), "COLUMNS": "120"}
    with (
        mock.patch.dict(os.environ, environment),
        mock.patch.object(sys, "argv", ["touchline", *arguments]),
        redirect_stdout(io.StringIO()) as output,
        redirect_stderr(io.StringIO()) as errors,
    ):
        code = execute()
    return subprocess.CompletedProcess(arguments, code, output.getvalue(), errors.getvalue())


def start_touchline(*arguments: str, config: BusConfig, log: Path) -> subprocess.Popen[bytes]:
    """``touchline ARGUMENTS`` left running, its output in ``log``."""
    with log.open("wb") as output:
        return subprocess.Popen(
            [sys.executable, "-m", "touchline", *arguments],
            env={**os.environ, **config.environment()},
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
        )


def figures(done: subprocess.CompletedProcess[str]) -> dict[str, Any]:
    """The JSON that the command printed."""
    assert done.returncode == 0, done.stderr
    loaded = json.loads(done.stdout)
    assert isinstance(loaded, dict)
    return loaded
