"""Messages of a service to systemd."""

import os
import signal
import socket
from types import SimpleNamespace

import pytest

from touchline.supervision import service_manager
from touchline.supervision.shutdown import until_stopped


@pytest.fixture
def manager(tmp_path, monkeypatch):
    """The service manager's end."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as end:
        end.bind(str(tmp_path / "notify"))
        end.setblocking(False)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        yield end


def test_a_service_is_ready_at_its_first_turn_and_feeds_the_watchdog(manager, monkeypatch):
    monkeypatch.setenv("WATCHDOG_USEC", "4000000")
    monkeypatch.setattr(service_manager, "time", SimpleNamespace(monotonic=lambda: now_s))
    with until_stopped() as stop:
        assert "NOTIFY_SOCKET" not in os.environ, "children do not inherit it"
        assert not stop.asked
        with pytest.raises(BlockingIOError):  # it still starts
            manager.recv(100)
        heard = []
        for now_s in (100.0, 100.5, 101.0, 101.5, 102.0):  # noqa: B007, the clock
            assert not stop
            try:
                heard.append(manager.recv(100))
            except BlockingIOError:
                heard.append(b"")
    assert heard == [b"READY=1", b"", b"WATCHDOG=1", b"", b"WATCHDOG=1"]


def test_a_manager_that_is_gone_or_does_not_listen_holds_up_nobody(manager, tmp_path, monkeypatch):
    monkeypatch.setenv("WATCHDOG_USEC", "1")
    with until_stopped() as stop:
        for _ in range(1000):  # more than its socket takes
            stop.beat()
        (tmp_path / "notify").unlink()
        stop.beat()


def test_children_of_a_supervisor_report_to_that(manager):
    with until_stopped(os.getppid()) as stop:
        stop.beat()
        with pytest.raises(BlockingIOError):
            manager.recv(100)
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
