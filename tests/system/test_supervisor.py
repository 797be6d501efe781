"""The supervisor and services that hang, fail or have started processes of their own."""

import os
import re
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

from touchline.bus import BusConfig
from touchline.schemas import topics
from touchline.supervision import supervisor as module
from touchline.supervision.supervisor import Child, Notice, Supervisor


@contextmanager
def supervised(folder: Path, config: BusConfig, arguments: Sequence[str], patience_s: float) -> Iterator[Supervisor]:
    supervisor = Supervisor([Child(topics.BRIDGE, arguments, patience_s)], config, folder, folder / "logs")
    supervisor.start()
    try:
        yield supervisor
    finally:
        supervisor.stop()


def notices_until(supervisor: Supervisor, condition: Callable[[list[Notice]], bool]) -> list[Notice]:
    notices: list[Notice] = []
    deadline = time.monotonic() + 100.0
    while not condition(notices):
        assert time.monotonic() < deadline, notices
        notices += supervisor.poll()
        time.sleep(0.01)
    return notices


def kinds(notices: list[Notice]) -> list[str]:
    return [notice.kind for notice in notices]


def test_a_loop_that_stands_still_is_told_and_started_again(tmp_path: Path, bus_config: BusConfig):
    """Threads of Zenoh, or a token, say nothing of the loop: it is its own beat that counts."""
    with supervised(tmp_path, bus_config, ["bridge"], 1000.0) as supervisor:
        (child,) = supervisor.children

        def turns() -> bool:
            return child.heartbeat is not None and child.heartbeat.begun and not child.hangs

        notices_until(supervisor, lambda _: turns())
        pid = supervisor.pid(topics.BRIDGE)
        os.kill(pid, signal.SIGSTOP)
        told = notices_until(supervisor, lambda notices: "hangs" in kinds(notices))
        (quiet_s,) = re.findall(r"^bridge hangs: its loop has not turned for (\d+\.\d) s$", told[-1].text)
        assert float(quiet_s) >= 1.0, "and more, where the machine is busy"
        os.kill(pid, signal.SIGCONT)
        assert "turns" in kinds(notices_until(supervisor, lambda notices: "turns" in kinds(notices)))
        child.patience_s = 1.2  # only now, for nobody knows how long a busy machine takes to continue a process
        os.kill(pid, signal.SIGSTOP)
        told = notices_until(supervisor, lambda notices: "restarted" in kinds(notices))
        assert kinds(told)[-4:] == ["hangs", "hung", "died", "restarted"]
        assert supervisor.pid(topics.BRIDGE) not in (None, pid)
        child.patience_s = 1000.0
        notices_until(supervisor, lambda _: turns())


def test_it_says_why_a_service_ended(tmp_path: Path, bus_config: BusConfig):
    with supervised(tmp_path, bus_config, ["bridge", "--record", "/no/such/\x1b[2Jplace.mcap"], 10.0) as supervisor:
        (notice, *_) = notices_until(supervisor, lambda notices: "died" in kinds(notices))
    assert notice.text.startswith("bridge ended with exit code 2: error: /no/such/place.mcap")


def test_it_names_the_log_of_a_service_that_ended_and_limits_its_output(
    tmp_path: Path, bus_config: BusConfig, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(module, "_OUTPUT_BYTES", 1000)
    with supervised(tmp_path, bus_config, ["bridge"], 1000.0) as supervisor:
        (child,) = supervisor.children
        notices_until(supervisor, lambda _: child.heartbeat is not None and child.heartbeat.begun)
        output = tmp_path / "bridge.output"
        output.write_text("x" * 1001)
        assert supervisor.poll() == []
        assert output.stat().st_size == 0
        pid = supervisor.pid(topics.BRIDGE)
        assert pid is not None
        os.kill(pid, signal.SIGKILL)
        (notice, *_) = notices_until(supervisor, lambda notices: "died" in kinds(notices))
    log = tmp_path / "logs" / f"bridge-tt2-{pid}.log"
    assert notice.text == f"bridge was ended by SIGKILL (log: {log})"
    assert "started with Python" in log.read_text()


@pytest.mark.parametrize("end", ["exit 3", "sleep 1000"], ids=["died", "stopped"])
def test_what_a_service_has_started_ends_with_it(tmp_path: Path, bus_config: BusConfig, monkeypatch, end: str):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    program = tmp_path / "program"
    program.write_text(f'#!/bin/sh\ntrap "" TERM\n(echo here; exec sleep 1000) > {pipe} &\n{end}\n')
    program.chmod(0o700)
    monkeypatch.setattr(sys, "executable", str(program))
    monkeypatch.setattr("touchline.supervision.supervisor._STOP_S", 0.1)
    with supervised(tmp_path, bus_config, [], 10.0) as supervisor, pipe.open() as held:
        assert held.readline() == "here\n"
        if end.startswith("exit"):
            assert "exit code 3" in notices_until(supervisor, lambda notices: "died" in kinds(notices))[0].text
        supervisor.stop()
        assert held.read() == "", "closed by whoever held it"


def test_code_in_the_current_folder_is_not_run(tmp_path: Path, bus_config: BusConfig, monkeypatch):
    for package in ("touchline", "numpy"):
        (tmp_path / package).mkdir()
        for name in ("__init__.py", "__main__.py"):
            (tmp_path / package / name).write_text("print('not ours')")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", ".::/no/such/folder")
    with supervised(tmp_path / "logs", bus_config, ["bridge"], 10.0) as supervisor:
        (child,) = supervisor.children
        notices = notices_until(supervisor, lambda notices: bool(notices) or child.heartbeat.begun)
        assert not notices
        assert supervisor.log_tail(topics.BRIDGE) == ""
