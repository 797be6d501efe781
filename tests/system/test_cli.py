"""The command line as a process: it ends in order at a signal, and the demo needs no terminal."""

import re
import signal
import time
from pathlib import Path

import pytest

from tests.system.commands import start_touchline, touchline


def _catches(pid: int, number: int) -> bool:
    """Whether a process has a handler for a signal; before that, no program can end in order."""
    (caught,) = re.findall(r"^SigCgt:\s*(\w+)", Path(f"/proc/{pid}/status").read_text(), re.MULTILINE)
    return bool(int(caught, 16) >> (number - 1) & 1)


@pytest.mark.parametrize(
    ("number", "after_s", "code"),
    [(signal.SIGINT, 0.0, 130), (signal.SIGTERM, 0.0, 143), (signal.SIGHUP, 0.1, 129), (signal.SIGTERM, 3.0, 143)],
)
def test_a_command_ends_in_order_at_a_signal(number, after_s, code, bus_config, tmp_path):
    log = tmp_path / "log"
    command = start_touchline("sweep", "tennis", "--seeds", "100000", config=bus_config, log=log)
    while not all(_catches(command.pid, each) for each in (signal.SIGTERM, signal.SIGHUP)):
        assert command.poll() is None, log.read_text()
        time.sleep(0.001)
    time.sleep(after_s)
    command.send_signal(number)
    assert command.wait(100) == code
    assert "interrupted" in log.read_text()
    assert "Traceback" not in log.read_text()


def test_demo_without_a_terminal_paints_the_pitch_to_two_centimetres(tmp_path: Path):
    done = touchline("demo", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    rows = (line.split() for line in done.stdout.splitlines())
    told = {row[0]: row[1] for row in rows if len(row) == 2}
    assert told["success"] == "yes"
    assert float(told["paint.coverage_pct"]) >= 99.0
    assert float(told["paint.lateral_error_m.p95"]) <= 0.02
    assert told["bus.lost"] == told["recording.lost"] == "0"
    assert (tmp_path / "session.mcap").stat().st_size > 1_000_000
