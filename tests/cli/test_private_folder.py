"""The run folder is ours alone, and nothing in it leads elsewhere."""

import os
import signal
import stat
import subprocess
import sys

import pytest

from touchline.schemas.errors import TouchlineError
from touchline.supervision.private_folder import open_private, run_folder
from touchline.supervision.running_system import _lock_path, only_one, running_pid, stop_running


@pytest.fixture
def base(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def test_it_is_made_private(base):
    assert run_folder() == base / "touchline"
    assert mode(run_folder()) == 0o700


def test_without_a_runtime_folder_there_is_one_per_user(tmp_path, monkeypatch):
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert run_folder() == tmp_path / f"touchline-{os.getuid()}"
    assert mode(run_folder()) == 0o700


@pytest.mark.parametrize("what", ["link", "file", "open", "another's"])
def test_a_folder_that_others_could_write_to_is_refused(base, what, monkeypatch):
    elsewhere = base / "elsewhere"
    elsewhere.mkdir()
    folder = base / "touchline"
    if what == "link":
        folder.symlink_to(elsewhere)
    elif what == "file":
        folder.write_text("")
    else:
        folder.mkdir()
        folder.chmod(0o777 if what == "open" else 0o700)
    if what == "another's":
        monkeypatch.setattr("os.getuid", lambda: 12345)
    with pytest.raises(TouchlineError, match="remove it, or set XDG_RUNTIME_DIR"):
        run_folder()


@pytest.mark.parametrize("link", [os.symlink, os.link])
def test_links_are_not_followed(base, bus_config, link):
    precious = base / "precious"
    precious.write_text("precious")
    link(precious, _lock_path(bus_config))
    with pytest.raises(TouchlineError, match="remove it"), only_one(bus_config):
        pass
    with pytest.raises(TouchlineError, match="remove it"):
        stop_running(bus_config, 1.0)
    assert precious.read_text() == "precious"


def test_files_are_readable_by_nobody_else(base, bus_config):
    _lock_path(bus_config).touch(mode=0o666)
    with only_one(bus_config):
        assert mode(_lock_path(bus_config)) == 0o600
        assert running_pid(bus_config) == os.getpid()
    assert running_pid(bus_config) is None
    os.close(open_private(base / "new", os.O_RDWR))
    assert mode(base / "new") == 0o600


def test_only_who_holds_the_lock_is_stopped(base, bus_config):
    """Whoever could write the file chose whom `touchline down` ended."""
    victim = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
    try:
        with only_one(bus_config):
            _lock_path(bus_config).write_text(str(victim.pid))
            with pytest.raises(TouchlineError, match="does not name the process that holds it"):
                stop_running(bus_config, 1.0)
        assert victim.poll() is None
    finally:
        victim.send_signal(signal.SIGKILL)
        victim.wait()
