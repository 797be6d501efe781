"""Log files of services, and what the command line shows of the log."""

import logging
import os
import re
import threading
from pathlib import Path

import pytest

from touchline.schemas.errors import TouchlineError
from touchline.supervision import service_log as module
from touchline.supervision.service_log import log_path, service_log

LOGGER = logging.getLogger("touchline.somewhere")


def own_file(folder: Path) -> Path:
    return log_path(folder, "planner", ("club/r1",), os.getpid())


def test_lines_have_time_level_service_and_process(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    with service_log("planner", ("club/r1",), None):
        LOGGER.info("fine")
        LOGGER.debug("too much")
        LOGGER.warning("from \x1b[2Ja stranger")
    started, fine, warned, ended = own_file(tmp_path / "touchline" / "log").read_text().splitlines()
    stamp = r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z"
    assert re.fullmatch(rf"{stamp} INFO planner\[{os.getpid()}\] touchline\.somewhere: fine", fine)
    assert " WARNING " in warned and warned.endswith(": from a stranger")
    assert "started with Python" in started and started.endswith("for club/r1")
    assert ended.endswith(": ended")


def test_an_error_is_logged_and_goes_on(tmp_path):
    with pytest.raises(ZeroDivisionError), service_log("planner", ("club/r1",), tmp_path):
        print(1 // 0)  # noqa: T201
    said = own_file(tmp_path).read_text()
    assert re.search(r"CRITICAL .*ended by an error\nTraceback .*\nZeroDivisionError", said, re.DOTALL)
    with pytest.raises(TouchlineError), service_log("planner", ("club/r1",), tmp_path):
        raise TouchlineError("port taken")
    assert own_file(tmp_path).read_text().splitlines()[-1].endswith("ended: port taken")


def test_an_error_of_a_thread_is_logged(tmp_path):
    with service_log("planner", ("club/r1",), tmp_path):
        thread = threading.Thread(target=lambda: 1 // 0, name="planning")
        thread.start()
        thread.join()
    said = own_file(tmp_path).read_text()
    assert re.search(r"planning ended by an error\nTraceback .*\nZeroDivisionError", said, re.DOTALL)


def test_standard_error_has_what_the_options_want(tmp_path, touchline, monkeypatch):
    """Also in a service, whose file has more; an error that ends it is reported once."""

    def serve(*_arguments, **_options):
        LOGGER.warning("odd")
        LOGGER.info("fine")
        LOGGER.debug("detail")
        raise TouchlineError("enough")

    monkeypatch.setattr("touchline.services.planner.service.run_service", serve)
    ends = ["", "info: fine\n", "info: fine\ndebug: detail\n"]
    for options, more in zip(([], ["-v"], ["-vv"]), ends, strict=True):
        code, _, errors = touchline("planner", "--logs", str(tmp_path), *options)
        monkeypatch.delenv("TOUCHLINE_VERBOSE", raising=False)
        shown = "".join(f"{line}\n" for line in errors.splitlines() if re.match("warning|info: fine|debug|error", line))
        assert (code, shown) == (2, f"warning: odd\n{more}error: enough\n")
    (file,) = tmp_path.iterdir()
    assert [text.count(": fine") for text in file.read_text().split("ended: enough")] == [1, 1, 1, 0]
    assert file.read_text().count(": detail") == 1


def test_files_are_limited_in_size_and_number(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "_FILE_BYTES", 1000)
    (tmp_path / "planner-club-r1-x-2.log").touch()  # another robot's
    for pid in range(2**22 + 1, 2**22 + 31):  # beyond what a process can have
        old = log_path(tmp_path, "planner", ("club/r1",), pid)
        old.touch()
        old.with_name(f"{old.name}.1").touch()
        os.utime(old, (pid, pid))
    with service_log("planner", ("club/r1",), tmp_path):
        for _ in range(100):
            LOGGER.info("x" * 100)
    files = sorted(tmp_path.iterdir())
    assert len(files) == 1 + 2 * module._KEPT
    assert log_path(tmp_path, "planner", ("club/r1",), 2**22 + 30) in files
    mine = [file for file in files if str(os.getpid()) in file.name]
    assert len(mine) == 2
    assert all(0 < file.stat().st_size <= 1000 for file in mine)


def test_a_folder_that_cannot_be_written_is_no_obstacle(tmp_path, caplog):
    (tmp_path / "file").touch()
    with service_log("planner", ("club/r1",), tmp_path / "file"):
        LOGGER.info("goes on")
    assert "there is no log file" in caplog.text


def test_a_full_disk_is_reported_once(tmp_path, capsys):
    own_file(tmp_path).symlink_to("/dev/full")
    with service_log("planner", ("club/r1",), tmp_path):
        for _ in range(3):
            LOGGER.info("goes on")
    assert capsys.readouterr().err.count("No space left on device") == 1
