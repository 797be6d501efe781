"""The certificate authority of a secured bus: a folder of keys with the access list and an identity for each member.

Only the authority's key, `authority/key.pem`, can issue, renew and revoke; everything else works without it.
"""

import getpass
import logging
import os
import re
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import timedelta
from itertools import count
from pathlib import Path
from typing import Final, Self

from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey

from touchline.schemas.errors import SpecError
from touchline.schemas.near_names import did_you_mean
from touchline.schemas.roles import Role, identity_name
from touchline.schemas.topics import NAMESPACE_RULE, is_namespace
from touchline.security import certificates
from touchline.security.access_list import (
    ACCESS_FILE,
    DEFAULT_ROUTER,
    AccessList,
    Member,
    address_of,
    checked_host,
    door_beside,
    load,
    signed,
)
from touchline.security.identity import AUTHORITY_FILE, CERTIFICATE_FILE, IDENTITIES, KEY_FILE, Identity
from touchline.security.key_files import (
    check_private,
    locked,
    make_private_folder,
    read_file,
    replace_files,
)

_logger = logging.getLogger(__name__)

DEFAULT_LIFE: Final = timedelta(days=30)
LOCAL_HOSTS: Final = ("localhost", "127.0.0.1", "::1")
_MAIN: Final = "main"
_LOST: Final = "put it back, or, if it is lost, make a new authority (docs/guides/security.md)"
_LONGEST_USER: Final = 32
#: Those whose members others connect to; to a viewer's, viewers with TLS.
_LISTENING: Final = (Role.ROUTER, Role.ROBOT, Role.VIEWER)
#: Processes of a system beside its robots and its operator.
_PROCESSES: Final = (
    Role.ROUTER,
    Role.PLANNER,
    Role.BRIDGE,
    Role.SUPERVISOR,
    Role.COORDINATOR,
    Role.GATEWAY,
    Role.OBSERVER,
    Role.VIEWER,
)


class CertificateAuthority:
    """The authority in a folder of keys; what it issues and revokes is on the disk when the method returns.

    Attributes:
        folder: The folder of keys.
        certificate: Its certificate.
        access: The access list.
    """

    def __init__(self, folder: Path) -> None:
        """Read it.

        Raises:
            SpecError: There is none, or its files are damaged or open to others.
        """
        if not os.path.lexists(folder / AUTHORITY_FILE):
            raise SpecError(str(folder), "", "holds no certificate authority", "make one: touchline keys init")
        check_private(folder)
        self.folder = folder
        self._ca_pem = read_file(folder / AUTHORITY_FILE)
        self.certificate = certificates.read_certificate(self._ca_pem, str(folder / AUTHORITY_FILE))
        try:
            self.access = load(folder / ACCESS_FILE, self._ca_pem)
        except SpecError as error:
            remedy = f"put back a backup, or the latest {IDENTITIES}/*/{ACCESS_FILE}"
            raise SpecError(error.source, error.field, error.problem, remedy) from error

    @classmethod
    def create(cls, folder: Path, router: str = DEFAULT_ROUTER) -> Self:
        """Make an authority and the router's identity.

        Args:
            folder: For its files; made if it is not there.
            router: Endpoint of the router.

        Raises:
            SpecError: The folder has keys already or cannot be written, or the endpoint cannot be used.
        """
        make_private_folder(folder)
        with locked(folder):
            return cls._created(folder, router)

    @classmethod
    @contextmanager
    def changing(cls, folder: Path) -> Iterator[Self]:
        """Yield the authority in a folder; others who want to change it wait meanwhile.

        Raises:
            SpecError: There is none, or its files are damaged or open to others.
        """
        cls(folder)  # says what is wrong, before a lock file is made
        with locked(folder):
            yield cls(folder)

    @classmethod
    def _created(cls, folder: Path, router: str) -> Self:
        made = (_key_of(folder), folder / AUTHORITY_FILE, folder / ACCESS_FILE)
        for path in made:
            if os.path.lexists(path):
                remedy = f"use it, or, for another router, move {folder} away"
                raise SpecError(str(path), "", "is there already", remedy)
        try:
            host, _ = address_of(router)
            door_beside(router, host)
            if not router.startswith("tls/"):
                raise ValueError(f"give an endpoint like {DEFAULT_ROUTER}")
        except ValueError as error:
            raise SpecError("command line", "--router", f"is {router!r}", str(error)) from error
        key, ca = certificates.new_authority()
        make_private_folder(_key_of(folder).parent)
        access = AccessList(number=1, issued=certificates.now(), router=router)
        text = signed(access, certificates.read_key(key, "the authority's key"))
        replace_files(dict(zip(made, (key, ca, text), strict=True)))
        authority = cls(folder)
        hosts = LOCAL_HOSTS if host in LOCAL_HOSTS else (host,)
        try:
            authority.issue([authority.new_member(Role.ROUTER, _MAIN, hosts)])
        except SpecError:  # no room: nobody has used the authority yet
            for path in made:
                path.unlink()
            raise
        return authority

    def new_member(self, role: Role, name: str, hosts: Sequence[str] = ()) -> Member:
        """Return a member to be issued.

        Args:
            role: What it may do.
            name: Of a robot, its namespace; else that of a person or a process.
            hosts: Names and IP addresses of its machine (default: this machine's loopback).

        Raises:
            SpecError: A name or address cannot be used.
        """
        is_robot = role is Role.ROBOT
        if is_robot and not is_namespace(name):
            raise SpecError("command line", "NAME", f"is {name!r}", f"give the robot's namespace: {NAMESPACE_RULE}")
        try:
            full = identity_name(role, name)
        except ValueError as error:
            problem, _, remedy = str(error).partition("; ")
            raise SpecError("command line", "NAME", problem, remedy or "give a shorter one") from error
        for host in hosts:
            try:
                checked_host(host)
            except ValueError as error:
                raise SpecError("command line", "--host", f"is {host!r}", str(error)) from error
        hosts = tuple(dict.fromkeys(hosts)) or LOCAL_HOSTS
        door = self._free_door("127.0.0.1" if hosts == LOCAL_HOSTS else hosts[0]) if is_robot else ""
        return Member(name=full, role=role, namespace=name if is_robot else "", hosts=hosts, door=door)

    def _free_door(self, host: str) -> str:
        """Return an endpoint for a robot's own door that no other robot of its machine has."""
        taken = {member.door for member in self.access.members}
        doors = (door for number in count() if (door := door_beside(self.access.router, host, number)) not in taken)
        return next(doors)

    def issue(self, members: Sequence[Member], life: timedelta = DEFAULT_LIFE) -> None:
        """Put new members on the access list, and make their identities.

        Args:
            members: By `new_member`.
            life: Time until their certificates expire.

        Raises:
            SpecError: One is issued or revoked already, the authority's key cannot be used, or there is no room.
        """
        for member in members:
            if member.name in self.access.revoked:
                raise SpecError("command line", "NAME", f"{member.name} is revoked", "give a name that is new")
            if self.access.member(member.name):
                raise SpecError("command line", "NAME", f"{member.name} is issued already", "renew or revoke it")
        key = self._key()
        access = self.access.changed(certificates.now(), members=(*self.access.members, *members))
        self._write(access, signed(access, key), self._identities(key, dict.fromkeys(members, life)))

    def _issue_missing(self, members: Iterable[Member]) -> None:
        missing = [member for member in members if not self.access.member(member.name)]
        if missing:
            self.issue(missing)

    def renew(self, members: Iterable[Member]) -> None:
        """Make new keys and certificates, valid for as long as the former ones were.

        Raises:
            SpecError: The authority's key cannot be used, or there is no room.
        """
        key = self._key()
        made = self._identities(key, {member: self._life(member) for member in members})
        self._write(self.access, read_file(self.folder / ACCESS_FILE), made)

    def revoke(self, member: Member) -> None:
        """Take a member off the access list for good, and delete its identity here.

        Raises:
            SpecError: The member is a router, the authority's key cannot be used, or there is no room.
        """
        if member.role is Role.ROUTER:
            remedy = "make a new authority and new identities: touchline keys init --folder FOLDER"
            raise SpecError(member.name, "", "cannot be revoked: it is the router that heeds the access list", remedy)
        key = self._key()
        kept = tuple(each for each in self.access.members if each != member)
        access = self.access.changed(certificates.now(), members=kept, revoked=(*self.access.revoked, member.name))
        self._write(access, signed(access, key), {})
        shutil.rmtree(self.folder_of(member), ignore_errors=True)  # worth nothing any more; it may be gone

    def due(self) -> list[Member]:
        """Return the members to be renewed: within the last third of their life, expired, damaged, or not here."""
        found = []
        for member in self.access.members:
            try:
                identity = Identity.load(self.folder_of(member))
            except SpecError:
                found.append(member)
                continue
            certificate = certificates.read_certificate(identity.certificate_pem, member.name)
            if (identity.expires - certificates.now()) * 3 < certificates.life_of(certificate):
                found.append(member)
        return found

    def named(self, name: str) -> Member:
        """Return the member of that name.

        Raises:
            SpecError: There is none.
        """
        member = self.access.member(name)
        if member:
            return member
        if name in self.access.revoked:
            raise SpecError("command line", "NAME", f"{name} is revoked", "issue another identity")
        near = did_you_mean(name, [each.name for each in self.access.members])
        raise SpecError("command line", "NAME", f"{name!r} is no member", near or "see `touchline keys list`")

    def folder_of(self, member: Member) -> Path:
        """Return the folder of a member's identity."""
        return self.folder / IDENTITIES / member.name

    def can_sign(self) -> bool:
        """Return whether the authority's key is here."""
        return os.path.lexists(_key_of(self.folder))

    def _key(self) -> EllipticCurvePrivateKey:
        """Return the authority's key, if it may be used now."""
        path = _key_of(self.folder)
        if not self.can_sign():
            raise SpecError(str(path), "", "is not here", _LOST)
        check_private(path)
        key = certificates.read_key(read_file(path), str(path))
        if not certificates.fits(key, self.certificate):
            raise SpecError(str(path), "", f"is not the key of {AUTHORITY_FILE}", "put the right one back")
        remedy = "make a new authority: touchline keys init --folder FOLDER"
        certificates.check_time(self.certificate, str(self.folder / AUTHORITY_FILE), remedy)
        if self.access.issued > certificates.now() + certificates.CLOCK_TOLERANCE:
            times = f"{certificates.shown(self.access.issued)}, and it is {certificates.shown(certificates.now())}"
            problem = f"was changed on {times} by the clock"
            raise SpecError(str(self.folder / ACCESS_FILE), "", problem, "set this machine's clock")
        return key

    def _life(self, member: Member) -> timedelta:
        path = self.folder_of(member) / CERTIFICATE_FILE
        try:
            return certificates.life_of(certificates.read_certificate(read_file(path), str(path)))
        except SpecError:
            return DEFAULT_LIFE

    def _identities(self, key: EllipticCurvePrivateKey, lives: Mapping[Member, timedelta]) -> dict[Path, bytes]:
        """Return the files of new identities."""
        files: dict[Path, bytes] = {}
        for member, life in lives.items():
            listens, folder = member.role in _LISTENING, self.folder_of(member)
            made = certificates.issue((key, self.certificate), member.name, member.hosts, life, listens=listens)
            files |= {folder / KEY_FILE: made[0], folder / CERTIFICATE_FILE: made[1]}
            files[folder / AUTHORITY_FILE] = self._ca_pem
        return files

    def _write(self, access: AccessList, text: bytes, identities: dict[Path, bytes]) -> None:
        """Write new identities, and the access list to the folder of keys and to all identities in it."""
        for path in identities:
            make_private_folder(path.parent)
        files = {**identities, self.folder / ACCESS_FILE: text}
        for member in access.members:
            if self.folder_of(member).is_dir():
                files[self.folder_of(member) / ACCESS_FILE] = text
        replace_files(files)
        self.access = access


def issued_for_system(folder: Path, namespaces: Sequence[str]) -> dict[Role | str, Identity]:
    """Return the identities of all processes of a system on this machine, and make or renew those that need it.

    Args:
        folder: The folder of keys; an authority is made if there is none.
        namespaces: Of the robots.

    Returns:
        Identities by role, and those of robots by namespace.

    Raises:
        SpecError: A namespace cannot be used, an identity is revoked, the files are damaged or cannot be written, or
            something has to be made or renewed and the authority's key is not here.
    """
    for namespace in set(namespaces) & set(Role):
        raise SpecError("command line", "--robot", f"is {namespace!r}", "give a robot another name than a role's")
    make_private_folder(folder)
    with locked(folder):
        if os.path.lexists(folder / AUTHORITY_FILE):
            authority = CertificateAuthority(folder)
        else:
            authority = CertificateAuthority._created(folder, DEFAULT_ROUTER)
        members: dict[Role | str, Member] = {role: authority.new_member(role, _MAIN) for role in _PROCESSES}
        members[Role.OPERATOR] = authority.new_member(Role.OPERATOR, _user())
        authority._issue_missing(members.values())
        for namespace in namespaces:  # one by one: each takes a free door
            members[namespace] = authority.new_member(Role.ROBOT, namespace)
            authority._issue_missing([members[namespace]])
        names = {member.name for member in members.values()}
        due = [member for member in authority.due() if member.name in names]
        if due and authority.can_sign():
            authority.renew(due)
        elif due:
            _logger.warning("the authority's key is not here; renew soon: %s", ", ".join(each.name for each in due))
        return {key: Identity.load(authority.folder_of(member)) for key, member in members.items()}


def _user() -> str:
    """Return the name of this user, as an identity's may be."""
    try:
        return re.sub(r"[^A-Za-z0-9_-]+", "-", getpass.getuser())[:_LONGEST_USER].strip("-") or str(os.getuid())
    except (KeyError, OSError):  # of a user without an entry
        return str(os.getuid())


def _key_of(folder: Path) -> Path:
    return folder / "authority" / KEY_FILE
