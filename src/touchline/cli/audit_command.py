"""``touchline audit``: the audit logs, which say who ordered what."""

import re
import sys
from dataclasses import asdict
from datetime import UTC, datetime, timedelta
from typing import Annotated, Final

import typer
from rich.markup import escape
from rich.table import Table

from touchline.cli.display import print_event, print_json, print_table, say
from touchline.cli.options import ExitCode, JsonOption
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import Event
from touchline.schemas.plain_text import plain
from touchline.schemas.user_folders import audit_folder
from touchline.security.audit_files import AuditEntry, AuditVerification, read_audit_logs, verify_audit_logs

_UNITS: Final = {"s": "seconds", "m": "minutes", "h": "hours", "d": "days"}
_DURATION: Final = re.compile(rf"(\d{{1,5}})([{''.join(_UNITS)}])")


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("audit")(audit)


def audit(
    robot: Annotated[
        str | None, typer.Option("--robot", metavar="NAMESPACE", help="Orders of this robot only.")
    ] = None,
    since: Annotated[
        str | None,
        typer.Option("--since", metavar="TIME", help="Orders of the last so many s, m, h or d: 90s, 1h, 7d."),
    ] = None,
    identity: Annotated[
        str | None, typer.Option("--identity", metavar="NAME", help="Orders of this identity only: operator.anna.")
    ] = None,
    verify: Annotated[
        bool, typer.Option("--verify", help="Verify that no line was changed or removed; exit code 1 if one was.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Show who ordered what on this machine, when, and the answers."""
    begin = _begin(since)
    folder = audit_folder()
    chosen = [
        entry
        for entry in read_audit_logs(folder)
        if robot in (None, entry.robot) and identity in (None, entry.identity) and entry.time >= begin
    ]
    chosen.sort(key=lambda entry: entry.time)
    verifications = verify_audit_logs(folder) if verify else []
    if as_json:
        _print_json(chosen, verifications, verified=verify)
    else:
        _print(chosen)
        for each in verifications:
            if not each.problems:
                say(f"{each.log}: {each.entries:,} lines, all as they were written")
    for each in verifications:
        for problem in each.problems:
            print_event(Event.WARN, f"{each.log}: {problem}")
    if any(each.problems for each in verifications):
        sys.exit(ExitCode.FAILED)


def _begin(since: str | None) -> datetime:
    if since is None:
        return datetime.min.replace(tzinfo=UTC)
    given = _DURATION.fullmatch(since)
    if given is None:
        raise SpecError("command line", "--since", f"is {since!r}", "give a number and s, m, h or d: 90s, 1h, 7d")
    return datetime.now(UTC) - timedelta(**{_UNITS[given[2]]: int(given[1])})


def _print(entries: list[AuditEntry]) -> None:
    table = Table(box=None, padding=(0, 2))
    for name in ("time", "robot", "node", "identity", "order", "answer", "text"):
        table.add_column(name)
    for entry in entries:
        if entry.lost_before:
            lost = f"{entry.lost_before:,} orders before this one could not be written"
            table.add_row("", entry.robot, entry.node, "", "", "", lost)
        time = entry.time.astimezone(UTC).strftime("%Y-%m-%d %H:%M:%S.%f")[:-3]
        texts = (entry.robot, entry.node, entry.identity, entry.order, entry.answer, entry.text)
        table.add_row(f"{time}Z", *(escape(plain(text)) for text in texts))
    print_table(table)


def _print_json(entries: list[AuditEntry], verifications: list[AuditVerification], *, verified: bool) -> None:
    orders = [asdict(entry) | {"time": entry.time.isoformat(timespec="milliseconds")} for entry in entries]
    logs = [asdict(each) | {"log": str(each.log)} for each in verifications]
    print_json({"orders": orders, **({"logs": logs} if verified else {})})
