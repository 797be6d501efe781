"""Watch of what a secured router refuses: Zenoh only logs it, so its log is read and put into the audit log."""

import os
import re
import threading
import time
from collections import Counter
from collections.abc import Callable
from typing import Final

import zenoh

from touchline.security.audit_log import AuditLog, OrderAnswer

_FILTER: Final = ",".join(
    (
        "off",
        "zenoh_link_tls=warn",
        "zenoh::net::routing::interceptor=trace",  # a line for each refused message; of the others it says nothing
        "zenoh::net::routing::interceptor::access_control=off",  # a line for every message
    )
)
_COLOURS: Final = re.compile(r"\x1b\[[0-9;]*m")
_HINT: Final = re.compile(r"\. Hint: .*| at /.*")
_REASONS: Final = {
    "peer sent no certificates": "no certificate",
    "InvalidContentType": "no TLS",
    "UnknownIssuer": "a certificate of another authority",
    "BadSignature": "a certificate of another authority",
    "Expired": "an expired certificate",
}
"""By a part of Zenoh's text, what whoever was refused had."""
_TOLD_EVERY_S: Final = 1.0
_READ_BYTES: Final = 65_536


def watch_refusals(audit: AuditLog, linked: Callable[[], str]) -> None:
    """Read Zenoh's log from now on, in a thread; to be called before the first session of this process.

    Args:
        audit: Audit log of the router.
        linked: Names of those who are linked now, for messages, of which Zenoh does not say who sent them.
    """
    ours, zenohs = os.pipe()
    os.dup2(zenohs, 1)  # the standard output, where Zenoh logs; a router prints nothing
    os.close(zenohs)
    zenoh.init_log_from_env_or(_FILTER)
    threading.Thread(target=_read, args=(ours, audit, linked), name="refusals", daemon=True).start()


def refusal_of(line: str) -> tuple[str, str] | None:
    """Return what was refused by a line of Zenoh's log, ``join`` or ``message``, and why; None if nothing was."""
    text = _COLOURS.sub("", line)
    if "Msg intercepted" in text:
        return "message", "not allowed to its sender, or an answer that came too late"
    _, found, reason = text.partition("zenoh_link_tls::unicast: ")
    if not found:
        return None
    known = (told for part, told in _REASONS.items() if part in reason)
    return "join", next(known, _HINT.sub("", reason).strip())


def _read(log: int, audit: AuditLog, linked: Callable[[], str]) -> None:
    rest, told_s = "", 0.0
    while data := os.read(log, _READ_BYTES):
        *lines, rest = (rest + data.decode(errors="replace")).split("\n")
        counted = Counter(refusal for line in lines if (refusal := refusal_of(line)) is not None)
        for (what, why), count in counted.items():
            times = f", {count} times" if count > 1 else ""
            who = f"; one of {linked()}" if what == "message" else ""
            audit.note("", what, OrderAnswer.REFUSED, f"{why}{times}{who}")
        # What comes meanwhile is counted together: whoever floods the router fills no disk.
        time.sleep(max(0.0, told_s + _TOLD_EVERY_S - time.monotonic()))
        told_s = time.monotonic()
