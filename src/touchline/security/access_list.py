"""The access list of a secured bus: who may join, signed by the certificate authority."""

import base64
import ipaddress
import json
import re
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Self

from pydantic import AfterValidator, AwareDatetime, Field, model_validator

from touchline.schemas.errors import SpecError
from touchline.schemas.roles import Role, identity_name
from touchline.schemas.spec import Spec, parse, read_text
from touchline.schemas.topics import NAMESPACE_RULE, is_namespace

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey

ACCESS_FILE: Final = "access.json"
_PURPOSE: Final = "access list"
_REMEDY: Final = "copy it anew from the folder of keys"
#: The last label begins with a letter: what looks like a wrong IP address is not taken for a name.
_DNS_NAME: Final = re.compile(r"([a-z0-9]([a-z0-9-]*[a-z0-9])?\.)*[a-z]([a-z0-9-]*[a-z0-9])?", re.IGNORECASE)
_LONGEST_HOST: Final = 253


def checked_host(text: str) -> str:
    """Return the name or the IP address of a machine, if it is one.

    Raises:
        ValueError: It is none.
    """
    if len(text) <= _LONGEST_HOST and _DNS_NAME.fullmatch(text):
        return text
    try:
        address = ipaddress.ip_address(text)
    except ValueError:
        raise ValueError("give the name or IP address of a machine") from None
    if address.is_unspecified or address.is_multicast or "%" in text:
        raise ValueError("give an address that others can connect to")
    return text


def address_of(endpoint: str) -> tuple[str, int]:
    """Return host and port of an endpoint such as ``tls/10.0.0.1:7461`` or ``quic/[::1]:7462``.

    Raises:
        ValueError: It is no such endpoint.
    """
    protocol, _, address = endpoint.partition("/")
    host, _, port = address.rpartition(":")
    if protocol not in ("tls", "quic") or not re.fullmatch(r"[0-9]{1,5}", port) or not 0 < int(port) < 65_536:
        raise ValueError("give an endpoint like tls/10.0.0.1:7461")
    bare = host.removeprefix("[").removesuffix("]")
    if (":" in bare) != (host != bare):
        raise ValueError("give an endpoint like tls/10.0.0.1:7461 or tls/[::1]:7461")
    return checked_host(bare), int(port)


def door_beside(router: str, host: str, number: int = 0) -> str:
    """Return the endpoint at which a robot on a host listens itself: QUIC, at a port after the router's.

    Args:
        router: Endpoint of the router.
        host: Name or IP address of the robot's machine.
        number: Number of the robot among those of that machine.

    Raises:
        ValueError: The router's endpoint cannot be used, or there is no such port.
    """
    port = address_of(router)[1] + 1 + number
    if port > 65_535:
        raise ValueError("give a lower port: robots listen at the next ones")
    return f"quic/[{host}]:{port}" if ":" in host else f"quic/{host}:{port}"


def _endpoint(text: str) -> str:
    address_of(text)
    return text


Host = Annotated[str, AfterValidator(checked_host)]
Endpoint = Annotated[str, AfterValidator(_endpoint)]


class Member(Spec):
    """One who may join.

    Attributes:
        name: Common name of its certificate: ``operator.anna``, ``robot.field.tt2``.
        role: What it may do.
        namespace: Of a robot; empty for others.
        hosts: Names and IP addresses of its machine.
        door: Endpoint at which a robot listens itself; empty for others.
    """

    name: str
    role: Role
    namespace: str = ""
    hosts: tuple[Host, ...] = Field(min_length=1)
    door: str = ""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        own = self.namespace if self.role is Role.ROBOT else self.name.removeprefix(f"{self.role}.")
        if self.role is Role.ROBOT:
            if not is_namespace(self.namespace):
                raise ValueError(f"its namespace: {NAMESPACE_RULE}")
            address_of(self.door)
        elif self.namespace or self.door:
            raise ValueError("only a robot has a namespace and a door")
        if identity_name(self.role, own) != self.name:
            raise ValueError(f"a name of the role {self.role} begins with {self.role}.")
        return self


class AccessList(Spec):
    """Those who may join a secured bus, and those who no longer may.

    Attributes:
        number: Grows with every change.
        issued: Time of the last change, UTC.
        router: Endpoint of the router, where all join.
        members: Those who may.
        revoked: Names that were taken off, and are never given again.
    """

    number: int = Field(ge=1)
    issued: AwareDatetime
    router: Endpoint
    members: tuple[Member, ...] = ()
    revoked: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _each_once(self) -> Self:
        names = [*(member.name for member in self.members), *self.revoked]
        if len(set(names)) < len(names):
            raise ValueError("name each member once, and none that is revoked")
        return self

    def member(self, name: str) -> Member | None:
        """Return the member of that name, if it is one."""
        return next((member for member in self.members if member.name == name), None)

    def changed(self, issued: datetime, **changes: Any) -> Self:
        """Return the next list: with these fields, and a number higher by 1."""
        return self.model_copy(update={"number": self.number + 1, "issued": issued, **changes})


class _SignedList(Spec):
    """The file: a list and the authority's signature of it, in base64."""

    access: dict[str, Any]
    signature: str


def load(path: Path, ca: bytes, at_least: int = 0) -> AccessList:
    """Return the access list in a file.

    Args:
        path: The file.
        ca: Certificate of the authority, PEM.
        at_least: Number of the latest list that the reader has seen; an older one is refused.

    Raises:
        SpecError: It cannot be read, is damaged, not signed by the authority, or older.
        MissingExtra: The package cryptography is not installed.
    """
    from touchline.security.certificates import is_signed, read_certificate

    found = parse(_SignedList, read_text(path), str(path))
    try:
        signature = base64.b64decode(found.signature, validate=True)
    except ValueError:
        signature = b""
    if not is_signed(read_certificate(ca, "the authority's certificate"), _PURPOSE, _signed(found.access), signature):
        raise SpecError(str(path), "", "is damaged, forged, or of another authority", _REMEDY)
    access = parse(AccessList, json.dumps(found.access), str(path))
    if access.number < at_least:
        raise SpecError(str(path), "", f"is list {access.number}, older than list {at_least} seen before", _REMEDY)
    return access


def signed(access: AccessList, key: "EllipticCurvePrivateKey") -> bytes:
    """Return the file of an access list, signed by the authority's key."""
    from touchline.security.certificates import sign

    content = access.model_dump(mode="json")
    signature = base64.b64encode(sign(key, _PURPOSE, _signed(content))).decode()
    return (json.dumps({"access": content, "signature": signature}, indent=1) + "\n").encode()


def _signed(content: dict[str, Any]) -> bytes:
    """Return the bytes that the signature is of: they do not depend on how the file is laid out."""
    return json.dumps(content, sort_keys=True, separators=(",", ":")).encode()
