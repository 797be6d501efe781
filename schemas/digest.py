"""Scenario hash (same inputs) and session hash (same messages) of a session.

Both are 64 bits of BLAKE2b in hex: enough to tell runs apart at a glance, not a defence against forgery.
"""

import hashlib
import json
import struct
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from touchline.schemas.known_ground import OPEN_GROUND, KnownGround
from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.setup import Setup
from touchline.schemas.template import Template
from touchline.schemas.topics import RECORDED, Topic

#: Payloads of a topic that are hashed at once. Changing it changes every session hash.
_BATCH = 64


def _blake() -> "hashlib.blake2b":
    return hashlib.blake2b(digest_size=8)


def scenario_hash(setup: Setup, template: Template, options: PlanOptions) -> str:
    """16 hex digits over all inputs of a session except the scenario's name.

    How areas are covered decides nothing where there are none, nor what is done where lines are obstructed where
    nothing can be in their way.
    """
    without = set() if template.areas else {"area_method"}
    without |= set() if template.obstacles or template.boundary else {"obstructed"}
    causes = {"template": template.model_dump(mode="json"), "plan": options.model_dump(mode="json", exclude=without)}
    return _of_causes(setup, causes)


def goal_scenario_hash(setup: Setup, goal: PoseGoal, options: PlanOptions, ground: KnownGround = OPEN_GROUND) -> str:
    """As `scenario_hash`, of a drive to a goal."""
    plan = options.model_dump(mode="json", exclude={"obstructed"})
    known = {"ground": ground.model_dump(mode="json")} if ground != OPEN_GROUND else {}
    return _of_causes(setup, {"goal": goal.model_dump(mode="json"), "plan": plan, **known})


def _of_causes(setup: Setup, job: dict[str, Any]) -> str:
    causes = {**setup.model_dump(mode="json", exclude={"scenario": {"name"}}), **job}
    digest = _blake()
    digest.update(json.dumps(causes, sort_keys=True, separators=(",", ":")).encode())
    return digest.hexdigest()


class _Waiting(NamedTuple):
    """Payloads of a topic that are not hashed yet: the size of each, and all of them one after another."""

    sizes: list[int]
    data: bytearray


class SessionDigest:
    """Running session hash over published payloads.

    Every recorded topic that is `hashed` has a hash of its own over its payloads in order; the session's is that of
    these. So it does not matter how topics interleave, and a topic without payloads counts too, if it is one of every
    session.
    """

    def __init__(self) -> None:
        """Nothing said yet."""
        self._digests = {topic.name: _blake() for topic in RECORDED if topic.hashed}
        self._waiting = {topic.name: _Waiting([], bytearray()) for topic in RECORDED if topic.hashed}
        self._hashed = {topic.name for topic in RECORDED if topic.hashed and topic.general}

    def add(self, said: Iterable[tuple[Topic, bytes]]) -> None:
        """Add payloads in order of publication; others than the hashed ones are ignored."""
        for topic, payload in said:
            self.add_of(topic, (len(payload),), payload)

    def add_of(self, topic: Topic, sizes: Sequence[int], data: bytes) -> None:
        """Add payloads of one topic in order: `data` are all of them, one after another."""
        waiting = self._waiting.get(topic.name)
        if waiting is None:
            return
        waiting.sizes.extend(sizes)
        waiting.data.extend(data)
        if (whole := len(waiting.sizes) // _BATCH * _BATCH) == 0:
            return
        self._hashed.add(topic.name)
        end = 0
        with memoryview(waiting.data) as view:
            for first in range(0, whole, _BATCH):
                batch = waiting.sizes[first : first + _BATCH]
                begin, end = end, end + sum(batch)
                self._take(self._digests[topic.name], batch, view[begin:end])
        del waiting.sizes[:whole], waiting.data[:end]

    def copy(self) -> "SessionDigest":
        """An independent copy of the digest as it is now."""
        twin = SessionDigest()
        twin._digests = {name: digest.copy() for name, digest in self._digests.items()}
        twin._hashed = self._hashed.copy()
        twin._waiting = {name: _Waiting(sizes.copy(), data.copy()) for name, (sizes, data) in self._waiting.items()}
        return twin

    def hexdigest(self) -> str:
        """16 hex digits over all payloads added so far."""
        session = _blake()
        for name in sorted(self._hashed.union(name for name, waiting in self._waiting.items() if waiting.sizes)):
            digest = self._digests[name].copy()
            self._take(digest, *self._waiting[name])
            session.update(name.encode() + b"\0" + digest.digest())
        return session.hexdigest()

    @staticmethod
    def _take(digest: "hashlib.blake2b", sizes: list[int], data: bytearray | memoryview) -> None:
        digest.update(struct.pack(f"<{len(sizes)}I", *sizes))
        digest.update(data)
