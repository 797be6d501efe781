"""Roles of those who join a secured bus, and the names of their identities."""

import re
from enum import StrEnum
from typing import Final

_NAME: Final = re.compile(r"[A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+)*")
LONGEST_NAME: Final = 64
"""Most characters of an identity's name: of a certificate's common name."""


class Role(StrEnum):
    """Part that an identity plays. What each may publish, serve and ask for is said by the topic table."""

    ROUTER = "router"
    ROBOT = "robot"
    PLANNER = "planner"
    BRIDGE = "bridge"
    OPERATOR = "operator"
    OBSERVER = "observer"
    SUPERVISOR = "supervisor"
    COORDINATOR = "coordinator"
    GATEWAY = "gateway"
    VIEWER = "viewer"


def identity_name(role: Role, name: str) -> str:
    """Return the name of an identity, its certificate's common name: ``operator.anna``, ``robot.field.tt2``.

    Args:
        role: Its role.
        name: Name of a person or process; of a robot, its namespace, whose slashes become dots.

    Raises:
        ValueError: The name cannot be used; the text says why.
    """
    full = f"{role}.{name.replace('/', '.')}" if role is Role.ROBOT else f"{role}.{name}"
    if not _NAME.fullmatch(full):
        raise ValueError(f"is {name!r}; use letters, digits, _ and -")
    if len(full) > LONGEST_NAME:
        raise ValueError(f"makes {full!r}, which is longer than {LONGEST_NAME} characters")
    return full
