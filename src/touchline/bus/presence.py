"""Presence of processes by liveliness tokens, which vanish within milliseconds when a process dies."""

import math
import re
import time
from collections import defaultdict
from typing import Final, NamedTuple, TypeAlias

import zenoh
from zenoh import handlers

#: Most tokens that came or went and wait to be polled; more push out the oldest, so that Zenoh's threads never wait.
_WAITING: Final = 1024
#: Most tokens that a count can find; if there are more, the count is incomplete.
_COUNTED: Final = 16_384
_COUNT_TIMEOUT_S: Final = 5.0
#: Time in which a client of a router knows whether others have gone, or its own link.
_GONE_S: Final = 0.25
#: Time in which all clients of a router are back after its session was opened anew.
_BACK_S: Final = 1.5
_NAMES: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")
_IDS: Final = re.compile(r"[0-9a-f]{1,32}")
EVERY_TOKEN: Final = "@touchline/**"
"""The key expression of the tokens of all robots."""

ROUTER_TOKEN: Final = "@touchline/router"
"""Token of a secured bus's router, which those see whom it admits."""

LivelinessReplies: TypeAlias = "handlers.Handler[zenoh.Reply]"


class Token(NamedTuple):
    """Contents of a liveliness token: the name of a process, and the Zenoh id of its session."""

    node: str
    instance: str


class PresenceChange(NamedTuple):
    """Process that came (``alive``) or went."""

    node: str
    instance: str
    alive: bool


class Presence:
    """Processes on the bus, kept up to date by :meth:`poll`.

    Rare polling delays nobody: what does not fit is dropped, and the tokens are counted anew.

    Attributes:
        linked: False while this process has no link to its router, as of the last :meth:`poll`.
    """

    def __init__(self, session: zenoh.Session, namespace: str) -> None:
        """Watch the tokens under ``namespace``; use :meth:`touchline.bus.Bus.presence`."""
        self._namespace = namespace
        self._prefix = token_prefix(namespace)
        self.declare(session)

    def declare(self, session: zenoh.Session) -> None:
        """Watch by this session from now on, starting empty."""
        self._session = session
        self._instances: defaultdict[str, set[str]] = defaultdict(set)
        self._gone: dict[Token, float] = {}
        self._routers: list[zenoh.ZenohId] = session.info.routers_zid()
        self._unlinked_s = -math.inf
        self.linked = True
        self._missed = False
        self._count: _Count | None = None
        self._subscriber = session.liveliness().declare_subscriber(
            all_tokens(self._namespace), handlers.RingChannel(_WAITING), history=True
        )

    def poll(self) -> list[PresenceChange]:
        """Return changes since the last call; never waits."""
        changes: list[PresenceChange] = []
        self._watch_link()
        taken = 0
        while taken < _WAITING and (sample := self._subscriber.try_recv()) is not None:
            taken += 1
            token = parse_token(str(sample.key_expr), self._prefix)
            if token is not None:
                if self._count is not None:
                    self._count.newer.add(token)
                self._note(token, sample.kind == zenoh.SampleKind.PUT, changes)
        self._missed = self._missed or taken == _WAITING  # it was full, so something may have been pushed out
        self._settle_gone(changes)
        if self._count is not None:
            self._finish_count(self._count, changes)
        elif self._missed:
            self._missed = False
            self._count = _Count(self._session, self._prefix)
        return changes

    def alive(self) -> set[str]:
        """Names of the present processes, as of the last :meth:`poll`."""
        return {node for node, instances in self._instances.items() if instances}

    def instances(self, node: str) -> frozenset[str]:
        """Return session ids of the processes of this name, as of the last :meth:`poll`."""
        return frozenset(self._instances.get(node, ()))

    def _watch_link(self) -> None:
        """Note when this process was last without the router through which it hears of all others, or had another."""
        if not self._routers:
            return
        routers = self._session.info.routers_zid()
        self.linked = bool(routers)
        if routers != self._routers:
            self._unlinked_s = time.monotonic()
            self._routers = routers or self._routers

    def _settle_gone(self, changes: list[PresenceChange]) -> None:
        """Let those go who are not back in time: in more, if this process has been without a link itself."""
        now_s = time.monotonic()
        for token, gone_s in list(self._gone.items()):
            if now_s - gone_s > (_BACK_S if self._unlinked_s > gone_s - _GONE_S else _GONE_S):
                del self._gone[token]
                self._change(token, False, changes)

    def _note(self, token: Token, alive: bool, changes: list[PresenceChange]) -> None:
        if alive:
            self._gone.pop(token, None)
        elif self._routers:
            self._gone.setdefault(token, time.monotonic())
            return
        self._change(token, alive, changes)

    def _change(self, token: Token, alive: bool, changes: list[PresenceChange]) -> None:
        instances = self._instances[token.node]
        if alive != (token.instance in instances):
            (instances.add if alive else instances.discard)(token.instance)
            changes.append(PresenceChange(*token, alive))
        if not instances:
            del self._instances[token.node]

    def _finish_count(self, count: "_Count", changes: list[PresenceChange]) -> None:
        if not count.poll():
            return
        self._count = None
        known = {Token(node, instance) for node, instances in self._instances.items() for instance in instances}
        for token in count.found - known - count.newer:
            self._note(token, True, changes)
        if count.whole:
            for token in known - count.found - count.newer:
                self._note(token, False, changes)


class _Count:
    """Query for tokens in progress.

    Attributes:
        found: Tokens that are there.
        newer: Tokens with a change since, which takes precedence.
        whole: Whether ``found`` has them all.
    """

    def __init__(self, session: zenoh.Session, prefix: str) -> None:
        self.found: set[Token] = set()
        self.newer: set[Token] = set()
        self.whole = False
        self._prefix = prefix
        self._replies: LivelinessReplies = session.liveliness().get(
            f"{prefix}/*/*", handlers.FifoChannel(_COUNTED), timeout=_COUNT_TIMEOUT_S
        )
        self._taken = 0

    def poll(self) -> bool:
        """Take replies; return whether all have come."""
        try:
            while (reply := self._replies.try_recv()) is not None:
                self._taken += 1
                if self._taken > _COUNTED:
                    return True
                token = parse_token(str(reply.ok.key_expr), self._prefix) if reply.ok is not None else None
                if token is not None:
                    self.found.add(token)
        except zenoh.ZError:  # the channel is closed: all replies have come
            self.whole = True
            return True
        return False


def token_prefix(namespace: str) -> str:
    """Return the prefix of the liveliness tokens; ``@`` keeps them out of every ``**``."""
    return f"@touchline/{namespace}"


def namespace_of(key: str) -> str:
    """Return the namespace of the token at ``key``; "" if it has none."""
    namespace = key.split("/")[1:-2]
    return "/".join(namespace)


def all_tokens(namespace: str, node: str = "*") -> str:
    """Return the key expression of the tokens of ``node``, or of every process."""
    return f"{token_prefix(namespace)}/{node}/*"


def parse_token(key: str, prefix: str) -> Token | None:
    """Parse the token at ``key``; ``None`` if it is not one of ours: anybody can declare any."""
    head, _, rest = key.partition(f"{prefix}/")
    node, _, instance = rest.partition("/")
    if head or not _NAMES.fullmatch(node) or not _IDS.fullmatch(instance):
        return None
    return Token(node, instance)
