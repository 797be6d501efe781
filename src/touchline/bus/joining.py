"""Opening and closing of Zenoh sessions: raises the descriptor limit, warns of remote access, bounds all waits."""

import errno
import logging
import resource
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Final

import zenoh
from zenoh import handlers

from touchline.bus.config import BusConfig, Door
from touchline.bus.presence import ROUTER_TOKEN
from touchline.bus.remote_access import check_exposure, endpoints, is_loopback, split
from touchline.schemas.bus_variables import ENDPOINT_VARIABLE
from touchline.schemas.errors import TouchlineError
from touchline.security.identity import Identity
from touchline.security.tls_check import why_refused

_LOG: Final = logging.getLogger(__name__)
#: Time after which a missing answer from the meeting point is reported; a busy machine may take longer.
_REPORT_AFTER_S: Final = 2.0
#: Time in which the router of a secured bus is seen by those whom it admits.
_ADMITTED_S: Final = 2.0
#: Time after which it is not one of ours.
_ABORT_AFTER_S: Final = 10.0
_POLL_S: Final = 0.01
#: Time for a connection to a router; it is made by the kernel, however busy the router is.
_LOOK_S: Final = 1.0
_LEAVE_S: Final = 2.0
#: Descriptors of a service besides its links: event queues, listeners, files, and links that are just being opened.
_OTHER_DESCRIPTORS: Final = 40
#: Fewer peers than this are soon reached: three services, consoles, orders, strangers.
_FEW_PEERS: Final = 100


#: What to do where nobody can listen, by the number of the system's error.
_LISTENING: Final = {
    errno.EADDRINUSE: "; stop what listens there",
    errno.EADDRNOTAVAIL: "; this machine has no such address: is the identity another machine's?",
}


def join(config: BusConfig, node: str, stop: Callable[[], bool] | None, patience_s: float) -> zenoh.Session:
    """Open a session on the bus; use :meth:`touchline.bus.Bus.open`.

    Raises:
        SpecError: The configuration cannot be used.
        TouchlineError: The endpoint cannot be used, other machines could reach an open bus, another program listens
            there, the router of a secured bus knows nothing of this identity, or there is no router and no `stop`.
        KeyboardInterrupt: ``stop()`` was true first.
    """
    settings = config.zenoh(node, patience_s)
    if config.identity is None:
        check_exposure(settings)
    _make_room()
    occupied = config.endpoint in endpoints(settings, "connect") and _occupied(config.endpoint)
    begun = time.monotonic()
    session = _opened(settings, config, stop)
    try:
        if config.identity is not None:
            _check_admitted(session, config.identity)
        elif occupied:
            _meet(session, config, begun, stop)
    except BaseException:
        leave(session, 0.0)
        raise
    _LOG.info("joined %s as %s", config.endpoint, node)
    return session


def leave(session: zenoh.Session, wait_s: float = _LEAVE_S) -> None:
    """Close a session; what takes longer than `wait_s` continues in the background.

    Zenoh waits for connections that are being opened, ten seconds for one that keeps silent, and raises after that.
    """

    def close() -> None:
        with suppress(zenoh.ZError):
            session.close()  # type: ignore[no-untyped-call]

    thread = threading.Thread(target=close, name="leave-bus", daemon=True)
    thread.start()
    thread.join(wait_s)


def join_at_door(config: BusConfig, door: Door, stop: Callable[[], bool]) -> zenoh.Session:
    """Open a session with the robot alone; use :meth:`touchline.bus.Bus.open_at_door`.

    Raises:
        TouchlineError: Nobody answers there.
        KeyboardInterrupt: ``stop()`` was true first.
    """
    return _opened(door.settings, config, stop)


def listen(settings: zenoh.Config, what: str) -> zenoh.Session:
    """Open a session that others join.

    Args:
        settings: Its configuration.
        what: What it is, for the error.

    Raises:
        TouchlineError: It cannot listen there.
    """
    zenoh.init_log_from_env_or("off")
    try:
        return zenoh.open(settings)
    except zenoh.ZError as error:
        reason = str(error).partition(" at /")[0]  # the rest is a place in Zenoh's own source
        where = ", ".join(endpoints(settings, "listen"))
        remedy = next((text for code, text in _LISTENING.items() if f"os error {code}" in reason), "")
        raise TouchlineError(f"{what} cannot listen on {where}: {reason}{remedy}") from error


def _opened(settings: zenoh.Config, config: BusConfig, stop: Callable[[], bool] | None) -> zenoh.Session:
    """Open in a thread: a client waits there for its router as long as it takes, and no signal would be handled.

    Raises:
        TouchlineError: It cannot be opened, or, without `stop`, nobody answers.
        KeyboardInterrupt: ``stop()`` was true first.
    """
    zenoh.init_log_from_env_or("off")
    sessions: list[zenoh.Session] = []
    errors: list[Exception] = []
    given_up = threading.Event()

    def work() -> None:
        try:
            session = zenoh.open(settings)
        except Exception as error:  # noqa: BLE001, raised again by who waits
            errors.append(error)
        else:
            sessions.append(session)
            if given_up.is_set():
                leave(session, 0.0)

    thread = threading.Thread(target=work, name="join-bus", daemon=True)
    thread.start()
    try:
        _wait_until_open(thread, settings, config, stop)
    except BaseException:
        given_up.set()
        raise
    if errors:
        reason = str(errors[0]).partition(" at /")[0]  # the rest is a place in Zenoh's own source
        raise TouchlineError(f"the bus at {config.endpoint} cannot be joined: {reason}") from errors[0]
    return sessions[0]


def _wait_until_open(
    opening: threading.Thread, settings: zenoh.Config, config: BusConfig, stop: Callable[[], bool] | None
) -> None:
    begun_s, reported = time.monotonic(), False
    while opening.is_alive():
        opening.join(_POLL_S)
        if stop is not None and stop():
            raise KeyboardInterrupt
        waited_s = time.monotonic() - begun_s
        if waited_s > _REPORT_AFTER_S and not reported:
            reported, reason = True, _why_silent(settings, config)
            if stop is None and reason and opening.is_alive():
                raise TouchlineError(reason)
            _LOG.warning("%s; still trying", reason or f"{_whom(settings)} does not answer")
        if stop is None and waited_s > _ABORT_AFTER_S:
            raise TouchlineError(_remedy(_whom(settings)))


def _whom(settings: zenoh.Config) -> str:
    return ", ".join(endpoints(settings, "connect")) or "the bus"


def _remedy(endpoint: str) -> str:
    who = f"what listens on {endpoint} does not answer; if it is another program, or frozen,"
    return f"{who} stop it, or choose another {ENDPOINT_VARIABLE}"


def _why_silent(settings: zenoh.Config, config: BusConfig) -> str:
    """Return why nobody answers; empty if that is not known. Zenoh reports whatever fails in TLS as a timeout."""
    absent = [_absence(endpoint) for endpoint in endpoints(settings, "connect")]
    if absent and all(absent):
        return f"{absent[0]}; start the router"
    whom = _whom(settings)
    return why_refused(whom, config.identity) if config.identity is not None and whom.startswith("tls/") else ""


def _absence(endpoint: str) -> str:
    """Return that nobody listens at an endpoint; empty if somebody does, or that cannot be known."""
    protocol, host, port = split(endpoint)
    if protocol not in ("tcp", "tls"):
        return ""
    try:
        socket.create_connection((host, int(port)), _LOOK_S).close()
    except OSError as error:
        return f"nobody listens at {endpoint} ({error.strerror or error})"
    return ""


def _check_admitted(session: zenoh.Session, identity: Identity) -> None:
    """Look for the router's token: access control hides it from those whom the router does not know.

    Raises:
        TouchlineError: It is not seen.
    """
    until_s = time.monotonic() + _ADMITTED_S
    while not list(session.liveliness().get(ROUTER_TOKEN, handlers.FifoChannel(1), timeout=_ADMITTED_S)):
        if time.monotonic() > until_s:
            remedy = "give the router the latest access.json; it admits new members once no robot has driven for 10 s"
            raise TouchlineError(
                f"the router at {identity.access.router} does not admit {identity.name}; if it is not revoked, {remedy}"
            )
        time.sleep(_POLL_S)


def _occupied(endpoint: str) -> bool:
    """Return whether somebody listens at the meeting point, if that is on this machine and can be known."""
    protocol, host, port = split(endpoint)
    if protocol != "tcp" or not is_loopback(endpoint) or not port.isdigit():
        return False
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, int(port)))
        except OSError as error:
            return error.errno == errno.EADDRINUSE
    return False


def _meet(session: zenoh.Session, config: BusConfig, begun_s: float, stop: Callable[[], bool] | None) -> None:
    """Wait for the peer that keeps the meeting point.

    Raises:
        TouchlineError: It does not answer as one of ours.
    """
    reported = False
    while not session.info.peers_zid() and not session.info.routers_zid():
        waited_s = time.monotonic() - begun_s
        if stop is not None and stop():
            raise KeyboardInterrupt
        if not reported and waited_s > _REPORT_AFTER_S:
            reported = True
            if not _occupied(config.endpoint):
                return  # it left meanwhile, and we take its place
            if "asks for a certificate" in why_refused(f"tls/{config.endpoint.partition('/')[2]}", None):
                raise TouchlineError(f"{config.endpoint} is a secured bus; give an identity: --identity")
            _LOG.warning("%s", _remedy(config.endpoint))
        if waited_s > _ABORT_AFTER_S:
            raise TouchlineError(_remedy(config.endpoint))
        time.sleep(_POLL_S)


def _make_room() -> None:
    """Allow as many open files as this process may have: every peer takes one, or two while both sides connect."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard == resource.RLIM_INFINITY or soft < hard:
        try:
            resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
            soft = hard
        except (OSError, ValueError):  # macOS has its own limit below an infinite one
            pass
    if soft == resource.RLIM_INFINITY:
        return
    room = max(0, (soft - _OTHER_DESCRIPTORS - _open_files()) // 2)
    if room < _FEW_PEERS:
        _LOG.warning("room for about %d peers; raise the limit of open files with ulimit -n", room)


def _open_files() -> int:
    folder = Path("/proc/self/fd")
    return sum(1 for _ in folder.iterdir()) if folder.is_dir() else 0
