"""Access control of a secured bus, generated from the topic table for Zenoh's routers and for a robot's own door.

Members hear everything. What they say is limited by their certificates' common names: a role publishes its topics,
serves its services and shows its tokens, a robot in its own namespace alone. Requests carry the caller's name at the
end of the key (`touchline.bus.caller`), which nobody else can write there, so that a server knows who asks.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import Any, Final

from touchline.bus.caller import asked_key, served_key
from touchline.bus.prompt import prompt_key
from touchline.schemas.roles import Role
from touchline.schemas.topics import (
    ALL_SERVICES,
    OBSERVER,
    ROBOT_SIM,
    ROLE_OF_NODE,
    SERVICES,
    TOPICS,
    Service,
    diagnostics_service,
)
from touchline.security.access_list import Member

_ANYWHERE: Final = "**"
_LATCHED: Final = "**/@adv/**"
_PROMPT: Final = prompt_key(_ANYWHERE)
_TOKENS: Final = "@touchline/**"
_ALL_MESSAGES: Final = (
    *("put", "delete", "query", "reply"),
    *("declare_subscriber", "declare_queryable"),
    *("liveliness_token", "liveliness_query", "declare_liveliness_subscriber"),
)
_DOOR_SERVICES: Final = (*(service for service in SERVICES if service.urgent), diagnostics_service(ROBOT_SIM))
"""Services at a robot's own door."""


def router_rules(members: Sequence[Member]) -> dict[str, Any]:
    """Return the section `access_control` of a router's configuration.

    Args:
        members: All who may join.
    """
    rules, policies = [*_hearing()], [_policy("hearing", [rule["id"] for rule in _hearing()], members)]
    for group in _alike(members):
        first = group[0]
        own = [*_publishing(first), *_serving(first), _presence(first)]
        rules += own
        policies.append(_policy(_speaker(first), [rule["id"] for rule in own], group))
    for member in members:
        rule = _ingress(f"call {member.name}", ["query"], [asked_key(_ANYWHERE, member.name)])
        rules.append(rule)
        policies.append(_policy(f"call {member.name}", [rule["id"]], [member]))
    return _section(rules, members, policies)


def door_rules(namespace: str, members: Sequence[Member]) -> dict[str, Any]:
    """Return the section `access_control` of a robot's own door, where it can be stopped and asked how it is.

    Args:
        namespace: The robot.
        members: All who may join.
    """
    rules = [_everything_out(), _watching()]
    policies = [_policy("hearing", [rule["id"] for rule in rules], members)]
    for member in members:
        keys = [asked_key(f"{namespace}/{service.name}", member.name) for service in _DOOR_SERVICES]
        rules.append(_ingress(f"call {member.name}", ["query"], keys))
        policies.append(_policy(f"call {member.name}", [f"call {member.name}"], [member]))
    return _section(rules, members, policies)


def is_at_door(service: Service[Any, Any]) -> bool:
    """Return whether a robot serves this at its own door, too."""
    return any(service.name == each.name for each in _DOOR_SERVICES)


def nodes_of(role: Role) -> tuple[str, ...]:
    """Return the names by which processes of a role may be present on the bus; anybody may watch it."""
    return (*(node for node, own in ROLE_OF_NODE.items() if own is role and node != OBSERVER), OBSERVER)


def _section(rules: list[dict[str, Any]], members: Iterable[Member], policies: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": member.name, "cert_common_names": [member.name]} for member in members],
        "policies": policies,
    }


def _policy(name: str, rules: list[str], members: Iterable[Member]) -> dict[str, Any]:
    return {"id": name, "rules": rules, "subjects": [member.name for member in members]}


def _ingress(name: str, messages: Sequence[str], keys: Sequence[str]) -> dict[str, Any]:
    flow = {"permission": "allow", "flows": ["ingress"]}
    return {"id": name, **flow, "messages": list(messages), "key_exprs": list(keys)}


def _everything_out() -> dict[str, Any]:
    rule = _ingress("out", _ALL_MESSAGES, [_ANYWHERE, _LATCHED, _PROMPT, asked_key(_ANYWHERE, "*"), _TOKENS])
    return rule | {"flows": ["egress"]}


def _hearing() -> list[dict[str, Any]]:
    return [
        _everything_out(),
        _ingress("subscribe", ["declare_subscriber"], [_ANYWHERE, _LATCHED, _PROMPT]),
        _ingress("history", ["query", "liveliness_query", "declare_liveliness_subscriber"], [_LATCHED]),
        _watching(),
    ]


def _watching() -> dict[str, Any]:
    return _ingress("watch", ["liveliness_query", "declare_liveliness_subscriber"], [_TOKENS])


def _alike(members: Iterable[Member]) -> list[list[Member]]:
    """Return members by what they may say: all of a role, but each robot by itself."""
    groups = defaultdict[str, list[Member]](list)
    for member in members:
        groups[_speaker(member)].append(member)
    return list(groups.values())


def _speaker(member: Member) -> str:
    return member.name if member.role is Role.ROBOT else member.role.value


def _place(member: Member) -> str:
    """Return the namespace in which a member speaks."""
    return member.namespace if member.role is Role.ROBOT else _ANYWHERE


def _publishing(member: Member) -> list[dict[str, Any]]:
    own = [topic for topic in TOPICS if member.role in topic.publishers]
    keys = [f"{_place(member)}/{topic.name}" for topic in own]
    keys += [prompt_key(f"{_place(member)}/{topic.name}") for topic in own if topic.prompt]
    latched = [f"{_place(member)}/{topic.name}" for topic in own if topic.latched]
    rules = []
    if keys:
        rules.append(_ingress(f"publish {_speaker(member)}", ["put"], keys))
    if latched:
        messages = ["declare_queryable", "liveliness_token", "reply", "put"]
        rules.append(_ingress(f"history {_speaker(member)}", messages, [f"{key}/@adv/**" for key in latched]))
        rules.append(_ingress(f"last {_speaker(member)}", ["reply"], latched))
    return rules


def _serving(member: Member) -> list[dict[str, Any]]:
    keys = [
        served_key(f"{_place(member)}/{service.name}") for service in ALL_SERVICES if member.role in service.servers
    ]
    return [_ingress(f"serve {_speaker(member)}", ["declare_queryable", "reply"], keys)] if keys else []


def _presence(member: Member) -> dict[str, Any]:
    keys = [f"@touchline/{_place(member)}/{node}/*" for node in nodes_of(member.role)]
    return _ingress(f"presence {_speaker(member)}", ["liveliness_token"], keys)
