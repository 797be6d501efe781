"""The audit log: what is written, what it survives, and what its hashes tell."""

import json
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path

import pytest
from click.testing import Result
from typer.testing import CliRunner

from tests.command import app
from touchline.schemas.errors import SpecError
from touchline.security import audit_log
from touchline.security.audit_files import KEPT_FILES, read_audit_logs, verify_audit_logs
from touchline.security.audit_log import AuditLog, OrderAnswer

NAME = "robot_sim@field.tt2.jsonl"


@contextmanager
def log(folder: Path, namespace: str = "field/tt2") -> Iterator[AuditLog]:
    opened = AuditLog(folder, "robot_sim", namespace)
    try:
        yield opened
    finally:
        opened.close()


def note(folder: Path, first: int = 0, orders: int = 3) -> None:
    """Add orders, numbered by their texts."""
    with log(folder) as opened:
        for number in range(first, first + orders):
            opened.note("operator.anna", "traversal/pause", OrderAnswer.ACCEPTED, str(number))


def problems(folder: Path) -> list[str]:
    return [problem for each in verify_audit_logs(folder) for problem in each.problems]


def texts(folder: Path) -> list[str]:
    return [entry.text for entry in read_audit_logs(folder)]


def test_a_line_says_who_ordered_what_and_the_answer(tmp_path: Path) -> None:
    folder = tmp_path / "state" / "audit"
    with log(folder) as opened:
        opened.note("observer.bob", "traversal/estop", OrderAnswer.REFUSED, "an observer may not")
    (line,) = (folder / NAME).read_text().splitlines()
    found = json.loads(line)
    time, digest = found.pop("time"), found.pop("sha256")
    assert time.endswith("+00:00") and len(time) == len("2026-01-01T00:00:00.000+00:00")
    assert found == {
        "number": 1,
        "node": "robot_sim",
        "robot": "field/tt2",
        "identity": "observer.bob",
        "order": "traversal/estop",
        "answer": "refused",
        "text": "an observer may not",
        "before": "",
    }
    assert digest == sha256(line[: line.index(', "sha256"')].encode()).hexdigest()
    assert stat.S_IMODE((folder / NAME).stat().st_mode) == 0o600 and stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_the_chain_goes_on_after_a_restart(tmp_path: Path) -> None:
    for first in (0, 3, 6):
        note(tmp_path, first)
    assert texts(tmp_path) == [str(number) for number in range(9)] and not problems(tmp_path)


def test_the_chain_goes_on_over_files_and_their_size_is_bounded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(audit_log, "_LARGEST_FILE_BYTES", 2000)
    monkeypatch.setattr(audit_log, "_MOST_AT_ONCE", 1)
    note(tmp_path, orders=10)
    assert len(texts(tmp_path)) == 10 and not problems(tmp_path)
    for first in (10, 60):
        note(tmp_path, first, orders=50)
    files = [each for each in tmp_path.iterdir() if not each.name.startswith(".")]
    assert len(files) == KEPT_FILES and all(each.stat().st_size <= 2000 for each in files)
    assert texts(tmp_path)[-1] == "109" and len(texts(tmp_path)) < 60 and not problems(tmp_path)
    (tmp_path / f"{NAME}.{KEPT_FILES - 1}").unlink()
    (problem,) = problems(tmp_path)
    assert "lines are missing before line 1" in problem


def edited(number: int, change: Callable[[bytes], bytes]) -> Callable[[list[bytes]], None]:
    def edit(lines: list[bytes]) -> None:
        lines[number] = change(lines[number])

    return edit


def rehashed(line: bytes) -> bytes:
    """The line with another identity and a hash that fits."""
    fields = json.loads(line.replace(b"anna", b"otto"))
    del fields["sha256"]
    text = json.dumps(fields).encode()[:-1]
    return text + f', "sha256": "{sha256(text).hexdigest()}"}}\n'.encode()


@pytest.mark.parametrize(
    ("edit", "told"),
    [
        (edited(1, lambda line: line.replace(b"accepted", b"refused")), f"line 2 of {NAME} was changed"),
        (edited(2, lambda line: line.replace(b"anna", b"otto")), f"line 3 of {NAME} was changed"),
        (edited(1, rehashed), f"the line before line 3 of {NAME} is not the one that was written"),
        (edited(0, lambda line: b"x" + line), f"line 1 of {NAME} is no entry"),
        (edited(1, lambda line: line.replace(b'"number": 2', b'"number": "2"')), f"line 2 of {NAME} is no entry"),
        (lambda lines: lines.pop(1), f"1 line is missing before line 2 of {NAME}"),
        (lambda lines: lines.pop(0), f"1 line is missing before line 1 of {NAME}"),
        (lambda lines: lines.insert(1, lines[0]), f"line 2 of {NAME} is repeated"),
        (lambda lines: lines.reverse(), f"line 2 of {NAME} is repeated"),
    ],
)
def test_changed_and_missing_lines_are_told(tmp_path: Path, edit: Callable[[list[bytes]], None], told: str) -> None:
    note(tmp_path)
    lines = (tmp_path / NAME).read_bytes().splitlines(keepends=True)
    edit(lines)
    (tmp_path / NAME).write_bytes(b"".join(lines))
    assert told in problems(tmp_path)


def test_lines_that_are_cut_off_are_told_by_the_process_that_wrote_them(tmp_path: Path) -> None:
    with log(tmp_path) as opened:
        opened.note("operator.anna", "traversal/pause", OrderAnswer.ACCEPTED)
        wait_for(lambda: len(texts(tmp_path)) == 1)
        (tmp_path / NAME).unlink()
        opened.note("operator.anna", "traversal/resume", OrderAnswer.ACCEPTED)
    assert problems(tmp_path) == [f"1 line is missing before line 1 of {NAME}"]


def wait_for(what: Callable[[], bool]) -> None:
    """Wait for the log's thread."""
    for _ in range(2000):
        if what():
            return
        time.sleep(0.005)
    raise AssertionError


def test_a_line_broken_off_by_a_power_cut_hides_nothing_behind_it(tmp_path: Path) -> None:
    note(tmp_path)
    (tmp_path / NAME).write_bytes((tmp_path / NAME).read_bytes()[:-40])
    note(tmp_path, 3)
    assert texts(tmp_path) == ["0", "1", "3", "4", "5"]
    assert problems(tmp_path) == [f"line 3 of {NAME} is no entry"]


def test_two_processes_of_the_same_name_have_a_log_each(tmp_path: Path) -> None:
    with log(tmp_path) as one, log(tmp_path) as other:
        for opened in (one, other):
            opened.note("operator.anna", "traversal/pause", OrderAnswer.ACCEPTED)
        wait_for(lambda: sum(each.entries for each in verify_audit_logs(tmp_path)) == 2)  # one could follow the other
    assert len(verify_audit_logs(tmp_path)) == 2 and not problems(tmp_path)


def test_a_folder_that_cannot_be_written_is_told_once_and_its_loss_noted(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = tmp_path / "audit"
    folder.write_text("no folder")
    with log(folder) as opened:
        for number in range(2):
            opened.note("operator.anna", "traversal/pause", OrderAnswer.ACCEPTED)
            wait_for(lambda number=number: opened._lost == number + 1)
        folder.unlink()
        opened.note("operator.anna", "traversal/resume", OrderAnswer.ACCEPTED)
    (entry,) = read_audit_logs(folder)
    assert (entry.order, entry.lost_before) == ("traversal/resume", 2)
    (told,) = [record.getMessage() for record in caplog.records]
    assert str(folder) in told and "orders are carried out without" in told


FULL_DISK = """
import resource, signal, sys
from pathlib import Path
from touchline.security.audit_log import AuditLog, OrderAnswer
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, resource.RLIM_INFINITY))
log = AuditLog(Path(sys.argv[1]), "robot_sim", "field/tt2")
for number in range(5):
    log.note("operator.anna", "traversal/pause", OrderAnswer.ACCEPTED, str(number))
    while not log._waiting.empty():
        pass
log.close()
resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
log = AuditLog(Path(sys.argv[1]), "robot_sim", "field/tt2")
log.note("operator.anna", "traversal/pause", OrderAnswer.ACCEPTED, "room again")
log.close()
"""


def test_a_full_disk_leaves_whole_lines(tmp_path: Path) -> None:
    subprocess.run([sys.executable, "-c", FULL_DISK, tmp_path], check=True, timeout=60)
    assert 0 < len(texts(tmp_path)) < 6 and texts(tmp_path)[-1] == "room again" and not problems(tmp_path)


def test_more_orders_than_the_disk_takes_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(audit_log, "_MOST_WAITING", 0)
    with log(tmp_path) as opened:
        opened.note("operator.anna", "traversal/pause", OrderAnswer.ACCEPTED)
        monkeypatch.setattr(audit_log, "_MOST_WAITING", 1000)
        opened.note("operator.anna", "traversal/resume", OrderAnswer.ACCEPTED)
    (entry,) = read_audit_logs(tmp_path)
    assert (entry.order, entry.lost_before) == ("traversal/resume", 1)


def test_links_are_not_followed(tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("mine\n")
    folder = tmp_path / "audit"
    folder.mkdir()
    (folder / NAME).symlink_to(tmp_path / "mine")
    note(folder)
    assert (tmp_path / "mine").read_text() == "mine\n"


def audit(*options: str) -> Result:
    return CliRunner().invoke(app, ["audit", *options])


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of audit logs, with orders of two robots."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    with log(tmp_path / "touchline" / "audit", "r1") as one, log(tmp_path / "touchline" / "audit", "r2") as other:
        one.note("operator.anna", "traversal/pause", OrderAnswer.ACCEPTED)
        time.sleep(0.002)  # times have milliseconds
        other.note("observer.bob", "traversal/resume", OrderAnswer.REFUSED, "\x1b]0;an observer may not\x07")
        time.sleep(0.002)
        one.note("operator.anna", "traversal/resume", OrderAnswer.ERROR, "not paused")
    return tmp_path / "touchline" / "audit"


def test_the_command_merges_and_chooses(folder: Path) -> None:
    rows = [line.split("\t") for line in audit().stdout.splitlines()]
    assert rows[0] == ["time", "robot", "node", "identity", "order", "answer", "text"]
    assert [row[1:6] for row in rows[1:]] == [
        ["r1", "robot_sim", "operator.anna", "traversal/pause", "accepted"],
        ["r2", "robot_sim", "observer.bob", "traversal/resume", "refused"],
        ["r1", "robot_sim", "operator.anna", "traversal/resume", "error"],
    ]
    assert "\x1b" not in audit().stdout
    assert len(audit("--robot", "r2").stdout.splitlines()) == 2
    assert len(audit("--identity", "operator.anna", "--since", "1h").stdout.splitlines()) == 3
    assert len(audit("--since", "0s").stdout.splitlines()) == 1
    orders = json.loads(audit("--json").stdout)["orders"]
    assert [order["answer"] for order in orders] == ["accepted", "refused", "error"]


def test_the_command_verifies(folder: Path) -> None:
    assert audit("--verify").exit_code == 0
    path = folder / "robot_sim@r1.jsonl"
    path.write_bytes(path.read_bytes().replace(b"anna", b"otto"))
    result = audit("--verify", "--json")
    assert result.exit_code == 1
    logs = {Path(each["log"]).name: each["problems"] for each in json.loads(result.stdout)["logs"]}
    assert len(logs["robot_sim@r1.jsonl"]) == 2 and not logs["robot_sim@r2.jsonl"]


def test_a_time_that_is_none_is_refused(folder: Path) -> None:
    result = audit("--since", "yesterday")
    assert isinstance(result.exception, SpecError) and "1h" in str(result.exception)
