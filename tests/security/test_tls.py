"""Certificates in real Zenoh sessions, and what is said of a handshake that fails."""

import contextlib
import json
import shutil
import socket
import threading
import time
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path

import pytest
import zenoh

from touchline.bus.ports import free_port
from touchline.schemas.roles import Role
from touchline.security import certificates, tls_check
from touchline.security.authority import CertificateAuthority
from touchline.security.identity import Identity
from touchline.security.tls_check import why_refused

PATIENCE_S = 120.0
ROUTER = Path("identities/router.main")


def config(endpoint: str, folder: Path, mode: str, timeout_ms: int = 10_000) -> zenoh.Config:
    settings = {
        "mode": mode,
        "scouting/multicast/enabled": False,
        "listen/endpoints": [endpoint] if mode == "router" else [],
        "connect/endpoints": [] if mode == "router" else [endpoint],
        "connect/timeout_ms": timeout_ms,
        "connect/exit_on_failure": True,
        "connect/retry": {"period_init_ms": 50, "period_max_ms": 100, "period_increase_factor": 1.5},
        "transport/link/tls/root_ca_certificate": str(folder / "ca.pem"),
        "transport/link/tls/listen_private_key": str(folder / "key.pem"),
        "transport/link/tls/listen_certificate": str(folder / "certificate.pem"),
        "transport/link/tls/connect_private_key": str(folder / "key.pem"),
        "transport/link/tls/connect_certificate": str(folder / "certificate.pem"),
        "transport/link/tls/enable_mtls": True,
        "transport/link/tls/close_link_on_expiration": True,
    }
    made = zenoh.Config()
    for key, value in settings.items():
        made.insert_json5(key, json.dumps(value))
    return made


@contextlib.contextmanager
def listening(folder: Path, protocol: str = "tls") -> Iterator[str]:
    """A router with the identity in a folder."""
    endpoint = f"{protocol}/127.0.0.1:{free_port()}"
    with zenoh.open(config(endpoint, folder, "router")):
        yield endpoint


def joins(endpoint: str, folder: Path, timeout_ms: int = 500) -> bool:
    try:
        with zenoh.open(config(endpoint, folder, "client", timeout_ms)) as session:
            return bool(session.info.routers_zid())
    except zenoh.ZError:
        return False


def wait_for(session: zenoh.Session, joined: bool) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while bool(session.info.routers_zid()) is not joined:
        assert time.monotonic() < end_s
        time.sleep(0.05)


def test_a_session_is_cut_off_when_its_certificate_expires_and_comes_back_with_a_renewed_one(
    authority: CertificateAuthority, monkeypatch: pytest.MonkeyPatch
) -> None:
    member = authority.new_member(Role.OPERATOR, "anna")
    authority.issue([member], timedelta(seconds=-1))
    folder = authority.folder_of(member)
    with listening(authority.folder / ROUTER) as endpoint:
        assert not joins(endpoint, folder)
        # On a busy machine seconds may pass before it joins: then it needs longer ones.
        for life_s in (3, 10, 30, 100):
            monkeypatch.setattr(authority, "_life", lambda _, life_s=life_s: timedelta(seconds=life_s))
            authority.renew([member])
            expires = certificates.read_certificate((folder / "certificate.pem").read_bytes(), "").not_valid_after_utc
            with contextlib.suppress(zenoh.ZError):
                session = zenoh.open(config(endpoint, folder, "client"))
                break
        with session:
            wait_for(session, joined=False)
            assert certificates.now() >= expires
            monkeypatch.setattr(authority, "_life", lambda _: timedelta(hours=1))
            authority.renew([member])
            wait_for(session, joined=True)


def test_a_robot_is_met_at_its_own_door_by_quic(authority: CertificateAuthority, anna: Identity) -> None:
    robot = authority.new_member(Role.ROBOT, "tt2")
    authority.issue([robot])
    with listening(authority.folder_of(robot), "quic") as endpoint:
        assert joins(endpoint, anna.folder, 10_000)
    with listening(anna.folder, "quic") as endpoint:
        assert not joins(endpoint, authority.folder_of(robot))


def let_expire(authority: CertificateAuthority, name: str) -> None:
    """Give a member a certificate that has expired."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(authority, "_life", lambda _: timedelta(seconds=-1))
        authority.renew([authority.named(name)])


def let_begin_later(authority: CertificateAuthority, name: str) -> None:
    """Give a member the certificate of an authority whose clock is ahead by an hour."""
    later = certificates.now() + timedelta(hours=1)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(certificates, "now", lambda: later)
        authority.renew([authority.named(name)])


def test_why_a_router_refuses_us(authority: CertificateAuthority, anna: Identity, tmp_path: Path) -> None:
    stranger = Identity.load(CertificateAuthority.create(tmp_path / "other").folder / ROUTER)
    with listening(authority.folder / ROUTER) as endpoint:
        assert joins(endpoint, anna.folder, 10_000) and why_refused(endpoint, anna) == ""
        assert why_refused(endpoint, None) == f"{endpoint} asks for a certificate; give an identity: --identity"
        shutil.copy(authority.folder / "ca.pem", stranger.folder)  # so that the router is accepted
        assert why_refused(endpoint, stranger) == (
            f"{endpoint} has another authority than router.main; use an identity of that authority"
        )
        for harm in (let_expire, let_begin_later):
            harm(authority, anna.name)
            assert not joins(endpoint, anna.folder)
            assert "finds operator.anna expired, or not valid yet; compare the clocks" in why_refused(endpoint, anna)
    assert why_refused(endpoint, anna) == f"nobody listens at {endpoint} (Connection refused)"


def test_why_we_refuse_a_router(authority: CertificateAuthority, anna: Identity, tmp_path: Path) -> None:
    elsewhere = authority.new_member(Role.ROUTER, "elsewhere", ("10.9.9.9",))
    observer = authority.new_member(Role.OBSERVER, "eve")
    authority.issue([elsewhere, observer])
    let_expire(authority, "router.main")
    for folder, says in (
        (authority.folder_of(elsewhere), "has a certificate for other hosts; issue one with --host"),
        (authority.folder_of(observer), "has a certificate of none that others may connect to; it is no router"),
        (authority.folder / ROUTER, "has an expired certificate; renew it, or compare the clocks of both machines"),
        (
            CertificateAuthority.create(tmp_path / "other").folder / ROUTER,
            "has a certificate of another authority; use an identity of that authority",
        ),
    ):
        with listening(folder) as endpoint:
            assert not joins(endpoint, anna.folder)
            assert why_refused(endpoint, anna) == f"{endpoint} {says}"
    let_begin_later(authority, "router.main")
    with listening(authority.folder / ROUTER) as endpoint:
        assert not joins(endpoint, anna.folder)
        assert "has a certificate that is not valid yet; compare the clocks" in why_refused(endpoint, anna)


def answer_in_clear(server: socket.socket) -> None:
    with server.accept()[0] as connection:
        connection.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")


def test_who_speaks_no_tls(anna: Identity, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tls_check, "_PATIENCE_S", 0.1)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        endpoint = f"tls/127.0.0.1:{silent.getsockname()[1]}"
        assert why_refused(endpoint, anna).startswith(f"{endpoint} speaks no TLS, or hangs")
    with socket.create_server(("127.0.0.1", 0)) as talking:
        monkeypatch.setattr(tls_check, "_PATIENCE_S", 60.0)
        answer = threading.Thread(target=answer_in_clear, args=(talking,))
        answer.start()
        endpoint = f"tls/127.0.0.1:{talking.getsockname()[1]}"
        assert why_refused(endpoint, anna).startswith(f"{endpoint} speaks no TLS")
        answer.join()
    with pytest.raises(ValueError, match="give an endpoint like tls/"):
        why_refused("quic/127.0.0.1:7462", anna)
