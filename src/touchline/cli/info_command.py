"""``touchline info``: contents of a recording, and its losses."""

import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape
from rich.table import Table

from touchline.cli.display import print_event, print_figures, print_json, print_table
from touchline.cli.options import ExitCode, JsonOption, RecordingArgument
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import Event
from touchline.schemas.plain_text import plain

if TYPE_CHECKING:
    from touchline.recordings.seal_verification import Verification


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("info")(info)


def info(
    file: RecordingArgument,
    verify: Annotated[
        bool, typer.Option("--verify", help="Verify that it is what was recorded; exit code 1 if that is not certain.")
    ] = False,
    authority: Annotated[
        Path | None,
        typer.Option(
            "--authority",
            metavar="ca.pem",
            help="Certificate of the authority that --verify trusts (default: the one in the folder of keys).",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show a recording's files, times, robots, topics, metadata and attachments, and its losses."""
    from touchline.recordings.recording_info import recording_info

    verification = _verified(file, authority) if verify else None
    found = recording_info(file)
    if as_json:
        print_json(found | ({} if verification is None else {"verification": verification.as_json()}))
    else:
        _print_info(file, found)
        if verification is not None:
            print_figures("Verification", {part.path.name: part.text for part in verification.files})
    if verification is not None and not verification.good:
        sys.exit(ExitCode.FAILED)


def _verified(file: Path, authority: Path | None) -> "Verification":
    from touchline.recordings.seal_verification import verify_recording
    from touchline.security.identity import verify

    return verify_recording(file, partial(verify, ca_pem=_trusted_pem(authority)))


def _trusted_pem(given: Path | None) -> bytes:
    """Return the certificate of the trusted authority.

    Args:
        given: Its file; None: the one that all identities in the default folder of keys have.
    """
    from touchline.schemas.user_folders import keys_folder
    from touchline.security.certificates import read_certificate
    from touchline.security.identity import AUTHORITY_FILE, IDENTITIES
    from touchline.security.key_files import read_file

    folder = keys_folder()
    files = [folder / AUTHORITY_FILE, *folder.glob(f"{IDENTITIES}/*/{AUTHORITY_FILE}")]
    found = {read_file(path): path for path in ([given] if given else files) if given or path.is_file()}
    if len(found) != 1:
        problem = f"has the certificates of {len(found)} authorities" if found else "has no authority's certificate"
        raise SpecError(str(folder), "", problem, "give the one to trust: --authority ca.pem")
    ((pem, path),) = found.items()
    read_certificate(pem, str(path))
    return pem


def _print_info(file: Path, found: dict[str, Any]) -> None:
    shown = ("complete", "bytes", "messages", "duration_s", "sim_time_s", "wall_time")
    print_figures(f"Recording {file}", {**{name: found[name] for name in shown}, "robots": ", ".join(found["robots"])})
    _print_topics(found["topics"])
    if len(found["files"]) > 1:
        print_figures("Files", {each["name"]: _file(each) for each in found["files"]})
    if found["attachments"]:
        print_figures("Attachments", {each["name"]: f"{each['bytes']:,} bytes" for each in found["attachments"]})
    if found["metadata"]:
        print_figures("Metadata", found["metadata"])
    if found["problem"]:
        print_event(Event.WARN, found["problem"])


def _file(file: dict[str, Any]) -> str:
    ending = "" if file["complete"] and not file["losses"] else ", damaged" if file["losses"] else ", broken off"
    return f"{file['messages']:,} messages, {file['bytes']:,} bytes{ending}"


def _print_topics(topics: dict[str, dict[str, Any]]) -> None:
    table = Table(title="Topics", title_justify="left", box=None, padding=(0, 2))
    for name in ("topic", "type", "encoding"):
        table.add_column(name)
    for name in ("messages", "rate Hz", "bytes"):
        table.add_column(name, justify="right")
    for name, topic in topics.items():
        rate = "–" if topic["rate_hz"] is None else f"{topic['rate_hz']:.4g}"
        texts = (escape(plain(text)) for text in (name, topic["type"], topic["encoding"]))
        table.add_row(*texts, f"{topic['messages']:,}", rate, f"{topic['bytes']:,}")
    print_table(table)
