"""Real secured system for the tests: `touchline up --secure` with two robots, and further identities."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import Any

import zenoh

from touchline.bus import BusConfig
from touchline.bus.ports import free_port
from touchline.bus.secured_settings import secured_client
from touchline.schemas.roles import Role
from touchline.security.access_list import Member
from touchline.security.authority import CertificateAuthority, issued_for_system
from touchline.security.identity import Identity

ROBOTS = ("tt2", "tt3")


@dataclass(frozen=True)
class SecuredSystem:
    """A running system.

    Attributes:
        keys: Folder of keys.
        endpoint: The router's.
        identities: By role, and by namespace of robots.
        state: Folder with its audit logs.
        process: Process of `touchline up`.
        log: Its output.
    """

    keys: Path
    endpoint: str
    identities: dict[Role | str, Identity]
    state: Path
    process: subprocess.Popen[bytes]
    log: Path

    def config(self, who: Role | str | Identity, *namespaces: str) -> BusConfig:
        """Return the bus configuration of an identity."""
        identity = who if isinstance(who, Identity) else self.identities[who]
        return BusConfig(self.endpoint, namespaces or ROBOTS[:1], identity=identity)

    @contextmanager
    def session(self, who: Role | str) -> Iterator[zenoh.Session]:
        """Open a session with the credentials of an identity, without any of our manners."""
        with zenoh.open(secured_client(self.identities[who], self.endpoint, 1.0)) as session:
            yield session

    def issue(self, role: Role, name: str, life: timedelta = timedelta(days=1), **changes: Any) -> Identity:
        """Issue a further identity."""
        with CertificateAuthority.changing(self.keys) as authority:
            member: Member = authority.new_member(role, name).model_copy(update=changes)
            authority.issue([member], life)
            return Identity.load(authority.folder_of(member))

    def audited(self) -> list[dict[str, Any]]:
        """Return all lines of the audit logs."""
        files = (self.state / "touchline" / "audit").glob("*.jsonl")
        return [json.loads(line) for file in files for line in file.read_text().splitlines()]


@contextmanager
def secured_system(folder: Path) -> Iterator[SecuredSystem]:
    """Start a system, and stop it at the end."""
    keys, state, log = folder / "config" / "touchline" / "keys", folder / "state", folder / "up.log"
    endpoint = f"tls/127.0.0.1:{free_port()}"
    folder.joinpath("config").mkdir(parents=True, exist_ok=True)
    CertificateAuthority.create(keys, endpoint)
    identities = issued_for_system(keys, ROBOTS)
    places = {"XDG_CONFIG_HOME": str(folder / "config"), "XDG_STATE_HOME": str(state)}
    fleet = folder / "fleet.json"
    fleet.write_text(json.dumps({"robots": [{"namespace": name} for name in ROBOTS]}))
    with log.open("wb") as output:
        process = subprocess.Popen(
            [sys.executable, "-m", "touchline", "up", "--secure", "--robots", str(fleet)],
            env={**os.environ, **places},
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
        )
    try:
        deadline = time.monotonic() + 300.0
        while b"Touchline is up" not in log.read_bytes():
            assert process.poll() is None, log.read_text()
            assert time.monotonic() < deadline, log.read_text()
            time.sleep(0.1)
        yield SecuredSystem(keys, endpoint, identities, state, process, log)
    finally:
        process.terminate()
        process.wait(30)
