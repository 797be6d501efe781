"""Check that a process has the identity that it needs on a secured bus."""

from touchline.bus.config import BusConfig
from touchline.schemas.bus_variables import IDENTITY_VARIABLE
from touchline.schemas.errors import SpecError
from touchline.schemas.roles import Role
from touchline.schemas.topics import OBSERVER, ROLE_OF_NODE


def check_identity(node: str, config: BusConfig) -> None:
    """Refuse an identity by which access control would let nothing through that a process says.

    Args:
        node: Name of the process.
        config: Its bus configuration.

    Raises:
        SpecError: The identity is of another role or robot.
    """
    identity, role = config.identity, ROLE_OF_NODE.get(node)
    if identity is None or role is None or node == OBSERVER:
        return
    if identity.role is not role:
        remedy = f"give an identity of the role {role}: touchline keys issue {role} NAME"
        raise SpecError(IDENTITY_VARIABLE, "", f"{identity.name} cannot join as {node}", remedy)
    if role is Role.ROBOT and config.namespaces != (identity.namespace,):
        problem = f"{identity.name} is of the robot {identity.namespace}, not of {', '.join(config.namespaces)}"
        raise SpecError(IDENTITY_VARIABLE, "", problem, "run each robot in its own process, with its own identity")
