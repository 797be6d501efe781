"""``touchline keys``: certificate authority, identities and access list of a secured bus."""

import socket
from collections.abc import Iterable
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape
from rich.table import Column, Table

from touchline.cli.display import print_event, print_json, print_line, print_table, say
from touchline.cli.options import JsonOption
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import Event
from touchline.schemas.roles import Role
from touchline.security.access_list import ACCESS_FILE, DEFAULT_ROUTER, Member

if TYPE_CHECKING:
    from touchline.security.authority import CertificateAuthority

FolderOption = Annotated[
    Path | None,
    typer.Option(
        "--folder",
        metavar="FOLDER",
        help="Folder of keys (default: $XDG_CONFIG_HOME/touchline/keys).",
    ),
]


def register(app: typer.Typer) -> None:
    """Add the subcommands to `app`."""
    group = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help=_HELP)
    group.command("init")(init)
    group.command("issue")(issue)
    group.command("renew")(renew)
    group.command("revoke")(revoke)
    group.command("list")(list_)
    app.add_typer(group, name="keys")


_HELP = "Make, renew, revoke and list the identities of a secured bus (docs/guides/security.md)."


def init(
    router: Annotated[
        str, typer.Option(metavar="ENDPOINT", help="Endpoint of the router, where all join.")
    ] = DEFAULT_ROUTER,
    folder: FolderOption = None,
) -> None:
    """Make a certificate authority, and the router's identity."""
    from touchline.security.authority import CertificateAuthority

    authority = CertificateAuthority.create(_folder(folder), router)
    say(f"made the certificate authority {_fingerprint(authority)} in {authority.folder}")
    say("keep a backup of that folder: who has its authority/key.pem decides who may join")


def issue(
    role: Annotated[Role, typer.Argument(metavar="ROLE", help="Part that it plays.", show_default=False)],
    name: Annotated[
        str,
        typer.Argument(metavar="NAME", help="Of a robot, its namespace; else a person or process.", show_default=False),
    ],
    host: Annotated[
        list[str] | None,
        typer.Option(
            "--host", metavar="ADDRESS", help="Name or IP address of its machine (default: this one); may be repeated."
        ),
    ] = None,
    days: Annotated[int, typer.Option(help="Time until it expires, days.", min=1, max=365)] = 30,
    folder: FolderOption = None,
) -> None:
    """Make an identity: a folder, to be copied to the machine that uses it."""
    from touchline.security.authority import CertificateAuthority

    with CertificateAuthority.changing(_folder(folder)) as authority:
        member = authority.new_member(role, name, host or ())
        authority.issue([member], timedelta(days=days))
        print_line(str(authority.folder_of(member)))
        _tell_whom_to_copy(authority, [member])
        _tell_whom_to_give_the_list(authority, member)


def renew(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]...", help="Identities (default: all in the last third of their life).", show_default=False
        ),
    ] = None,
    folder: FolderOption = None,
) -> None:
    """Make new keys and certificates for identities that expire soon, or those named."""
    from touchline.security.authority import CertificateAuthority

    with CertificateAuthority.changing(_folder(folder)) as authority:
        members = [authority.named(name) for name in dict.fromkeys(names)] if names else authority.due()
        if not members:
            say("nothing expires soon")
            return
        authority.renew(members)
        for member in members:
            print_line(str(authority.folder_of(member)))
        _tell_whom_to_copy(authority, members)


def revoke(
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="The identity, such as `operator.anna`.", show_default=False)
    ],
    folder: FolderOption = None,
) -> None:
    """Take an identity off the access list, for good."""
    from touchline.security.authority import CertificateAuthority

    with CertificateAuthority.changing(_folder(folder)) as authority:
        if name in authority.access.revoked:
            authority.renew(())  # a revocation that was interrupted may have left older lists
            say(f"{name} is revoked already")
        else:
            authority.revoke(authority.named(name))
            say(f"revoked {name}; its name is not issued again")
        _tell_whom_to_give_the_list(authority)


def list_(folder: FolderOption = None, as_json: JsonOption = False) -> None:
    """List the identities, and when they expire."""
    from touchline.security.authority import CertificateAuthority
    from touchline.security.certificates import shown

    authority = CertificateAuthority(_folder(folder))
    rows = [
        *(
            (each.name, each.role, ", ".join(each.hosts), _validity(authority, each))
            for each in authority.access.members
        ),
        *((name, name.partition(".")[0], "", "revoked") for name in authority.access.revoked),
    ]
    if as_json:
        print_json([dict(zip(("name", "role", "hosts", "valid_until"), row, strict=True)) for row in rows])
        return
    ends, number = shown(authority.certificate.not_valid_after_utc), authority.access.number
    title = f"certificate authority {_fingerprint(authority)}, valid until {ends}; access list {number}"
    table = Table(Column("name", no_wrap=True), "role", "hosts", "valid until", title=title, title_justify="left")
    for row in rows:
        table.add_row(*map(escape, row))
    print_table(table)


def _folder(given: Path | None) -> Path:
    from touchline.schemas.user_folders import keys_folder

    return keys_folder() if given is None else given.absolute()


def _fingerprint(authority: "CertificateAuthority") -> str:
    from touchline.security.certificates import fingerprint

    return fingerprint(authority.certificate)


def _validity(authority: "CertificateAuthority", member: Member) -> str:
    """Return the end of a member's certificate here, and how far away it is."""
    from touchline.security.certificates import now, read_certificate, shown
    from touchline.security.identity import CERTIFICATE_FILE
    from touchline.security.key_files import read_file

    path = authority.folder_of(member) / CERTIFICATE_FILE
    if not path.parent.exists():
        return "not in this folder"
    try:
        end = read_certificate(read_file(path), CERTIFICATE_FILE).not_valid_after_utc
    except SpecError as error:
        return f"{CERTIFICATE_FILE} {error.problem}"
    return f"{shown(end)} ({_until(end, now())})"


def _until(end: datetime, now: datetime) -> str:
    if end <= now:
        return "expired"
    hours = (end - now).total_seconds() / 3600
    return f"in {hours / 24:.0f} days" if hours > 48 else f"in {hours:.0f} h"


def _tell_whom_to_copy(authority: "CertificateAuthority", members: Iterable[Member]) -> None:
    for member in filter(_is_remote, members):
        say(f"copy {authority.folder_of(member)} to {member.hosts[0]}")


def _tell_whom_to_give_the_list(authority: "CertificateAuthority", issued: Member | None = None) -> None:
    """Name the machines that have an older access list, first those of the router and the robots, who heed it."""
    heeding = (Role.ROUTER, Role.ROBOT)
    remote = [each for each in authority.access.members if each != issued and _is_remote(each)]
    for member in sorted(remote, key=lambda each: each.role not in heeding):
        path = authority.folder_of(member) / ACCESS_FILE
        print_event(Event.WARN, f"{member.hosts[0]} has an older access list: copy {path} to the folder {member.name}")


def _is_remote(member: Member) -> bool:
    """Return whether a member's machine is another one; on this one the files of the keys folder itself are used."""
    return not any(map(_is_here, member.hosts))


def _is_here(host: str) -> bool:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.bind((host, 0))  # which takes an address of this machine
    except OSError:
        return False
    return True
