"""Files of the audit logs: their names and lines, reading and verifying them."""

import json
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

from touchline.schemas.errors import SpecError

KEPT_FILES: Final = 8
"""Files of one log: the present one and the older ones."""
_SUFFIX: Final = ".jsonl"
_NAME: Final = re.compile(r"(?P<log>.+\.jsonl(\+\d+)?)(\.(?P<age>[1-9]))?")
_HASH: Final = re.compile(rb', "sha256": "([0-9a-f]{64})"}\n')
_HASH_BYTES: Final = len(b', "sha256": ""}\n') + 64
_TAIL_BYTES: Final = 256 * 1024


@dataclass(frozen=True)
class AuditEntry:
    """One line of an audit log.

    Attributes:
        number: Number of the line in its log, from 1.
        time: When the order was answered, UTC.
        node: Process that answered.
        robot: Namespace of the robot.
        identity: Who gave the order.
        order: Name of the service.
        answer: "accepted", "refused" or "error".
        text: Text of the answer.
        lost_before: Orders before this one that could not be written.
        before: Hash of the line before; empty in the first one.
        sha256: Hash of this line up to there.
    """

    number: int
    time: datetime
    node: str
    robot: str
    identity: str
    order: str
    answer: str
    text: str
    before: str
    sha256: str
    lost_before: int = 0


@dataclass(frozen=True)
class AuditVerification:
    """Verification of one audit log.

    Attributes:
        log: Path of its present file.
        entries: Entries that can be read.
        problems: Lines that were changed or are missing, a sentence each.
    """

    log: Path
    entries: int
    problems: tuple[str, ...]


def log_name(node: str, namespace: str) -> str:
    """Return the name of the file of a log.

    Args:
        node: Name of the process.
        namespace: Namespace of the robot; empty for a process without one.
    """
    return f"{node}@{namespace.replace('/', '.')}{_SUFFIX}" if namespace else f"{node}{_SUFFIX}"


def older(path: Path, age: int) -> Path:
    """Return the name of an older file of a log: 0 is the present one."""
    return path.with_name(f"{path.name}.{age}") if age else path


def with_hash(fields: dict[str, Any]) -> tuple[bytes, str]:
    """Return the line of an entry, and its hash: of the line up to the comma before the hash itself."""
    text = json.dumps(fields).encode().removesuffix(b"}")
    digest = sha256(text).hexdigest()
    return text + f', "sha256": "{digest}"}}\n'.encode(), digest


def last_line(path: Path) -> tuple[int, str]:
    """Return number and hash of the last entry of a log; 0 and an empty text if there is none.

    Raises:
        OSError: A file is there and cannot be read.
    """
    for age in range(KEPT_FILES):
        try:
            with older(path, age).open("rb") as stream:
                stream.seek(max(os.fstat(stream.fileno()).st_size - _TAIL_BYTES, 0))
                lines = stream.read().splitlines(keepends=True)
        except FileNotFoundError:
            continue
        for line in reversed(lines):
            if (entry := _parsed(line)) is not None:
                return entry.number, entry.sha256
    return 0, ""


def read_audit_logs(folder: Path) -> Iterator[AuditEntry]:
    """Yield the entries of all logs in a folder, one log after another; lines that are none are left out.

    Raises:
        SpecError: A file cannot be read.
    """
    for files in _logs(folder).values():
        for path in files:
            yield from (entry for line in _lines(path) if (entry := _parsed(line)) is not None)


def verify_audit_logs(folder: Path) -> list[AuditVerification]:
    """Verify the hashes of all logs in a folder.

    Who can write the files can also make all hashes anew: the verification finds what is changed or removed otherwise,
    but for the last lines of a log.

    Raises:
        SpecError: A file cannot be read.
    """
    return [_verified(log, files) for log, files in _logs(folder).items()]


def _verified(log: Path, files: list[Path]) -> AuditVerification:
    problems, entries = [], 0
    number, before = 0, ""
    for path in files:
        for place, line in enumerate(_lines(path), start=1):
            where = f"line {place} of {path.name}"
            entry = _parsed(line)
            if entry is None:
                problems.append(f"{where} is no entry")
                continue
            missing = entry.number - number - 1
            if not entries and len(files) == KEPT_FILES:  # those before it were removed as the log grew
                missing, before = 0, entry.before
            if missing > 0:
                lines = "1 line is" if missing == 1 else f"{missing:,} lines are"
                problems.append(f"{lines} missing before {where}")
            elif missing < 0:
                problems.append(f"{where} is repeated")
            elif entry.before != before:
                problems.append(f"the line before {where} is not the one that was written")
            if sha256(line[:-_HASH_BYTES]).hexdigest() != entry.sha256:
                problems.append(f"{where} was changed")
            number, before, entries = entry.number, entry.sha256, entries + 1
    return AuditVerification(log, entries, tuple(problems))


def _logs(folder: Path) -> dict[Path, list[Path]]:
    """Return the files of each log in a folder, the oldest first, by the path of the present one."""
    found: dict[Path, dict[int, Path]] = {}
    try:
        for path in sorted(folder.iterdir()) if folder.is_dir() else ():
            if (name := _NAME.fullmatch(path.name)) is not None and not path.name.startswith("."):
                found.setdefault(folder / name["log"], {})[int(name["age"] or 0)] = path
    except OSError as error:
        raise _unreadable(folder, error) from error
    return {log: [files[age] for age in sorted(files, reverse=True)] for log, files in found.items()}


def _lines(path: Path) -> list[bytes]:
    try:
        return path.read_bytes().splitlines(keepends=True)
    except OSError as error:
        raise _unreadable(path, error) from error


def _unreadable(path: Path, error: OSError) -> SpecError:
    return SpecError(str(path), "", f"cannot be read ({error.strerror})", "be the user whose processes wrote it")


def _parsed(line: bytes) -> AuditEntry | None:
    """Parse a line; None if it is no entry."""
    if not _HASH.fullmatch(line[-_HASH_BYTES:]):
        return None
    try:
        fields = json.loads(line)
        entry = AuditEntry(**fields | {"time": datetime.fromisoformat(fields["time"])})
    except (ValueError, TypeError, KeyError, RecursionError):
        return None
    as_written = all(type(getattr(entry, name)) is kind for name, kind in AuditEntry.__annotations__.items())
    return entry if as_written and entry.time.tzinfo is not None else None
