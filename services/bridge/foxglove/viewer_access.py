"""Requirements for viewers beside an allowed origin: TLS, a token, and an identity for their orders."""

from __future__ import annotations

import re
import secrets
import ssl
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

from touchline.bus import BusConfig
from touchline.schemas.bus_variables import is_open_to_network
from touchline.schemas.errors import SpecError
from touchline.schemas.loopback import is_loopback_host
from touchline.schemas.roles import Role
from touchline.schemas.user_folders import keys_folder
from touchline.security.identity import Identity
from touchline.security.key_files import check_private, make_private_folder, read_file, replace_files
from touchline.services.bridge.door_identity import door_identity
from touchline.services.bridge.foxglove.viewer_address import FoxgloveConfig

_FILE_NAME: Final = "viewers.token"
_TOKEN_BYTES: Final = 24
#: What needs no escape in a URL, and is not guessed.
_TOKEN: Final = re.compile(r"[A-Za-z0-9_-]{16,256}")


@dataclass(frozen=True)
class ViewerAccess:
    """Requirements for viewers beside an allowed origin.

    Attributes:
        identity: Identity in whose name viewers ask on a secured bus; None on an open one, or if they only watch.
        certificate, key: Files of TLS; None without it.
        token_file: File of the token; None if no token is required.
        token: What viewers present; empty if nothing.
    """

    identity: Identity | None = None
    certificate: Path | None = None
    key: Path | None = None
    token_file: Path | None = None
    token: str = ""

    @classmethod
    def of(cls, config: FoxgloveConfig, bus: BusConfig) -> Self:
        """Return the requirements by the options, and by how far address and bus are open; make a missing token.

        Args:
            config: Options of the server.
            bus: Configuration of the bus.

        Raises:
            SpecError: The address is open to the network without protection, viewers may order and nobody knows in
                whose name, or a file cannot be used.
        """
        identity = door_identity(bus, Role.VIEWER, config.identity)
        secured, remote = bus.identity is not None, not is_loopback_host(config.host)
        if secured and config.orders and identity is None:
            remedy = "give --viewer-identity NAME (touchline keys issue viewer NAME), in whose name they command"
            raise SpecError("command line", "--foxglove-orders", "is given on a secured bus", remedy)
        certificate, key = config.certificate, config.key
        if remote and certificate is None and identity is not None:
            certificate, key = identity.certificate, identity.key
        if remote and certificate is None and (secured or not is_open_to_network()):
            raise _exposed(config, secured=secured)
        token_file = config.token
        if token_file is None and (secured or (remote and certificate is not None)):
            make_private_folder(keys_folder())
            token_file = keys_folder() / _FILE_NAME
        access = cls(identity, certificate, key, token_file, _token_in(token_file) if token_file is not None else "")
        access.check_tls()
        return access

    def url(self, host: str, port: int) -> str:
        """Return the URL at which viewers connect, without the token."""
        return f"{'ws' if self.certificate is None else 'wss'}://{host}:{port}"

    def hint(self) -> str:
        """Return what viewers need beside the URL, for the user; empty if nothing."""
        return f"/?token=TOKEN, with the token in {self.token_file}" if self.token else ""

    def tls_context(self) -> ssl.SSLContext | None:
        """Return TLS settings by the files as they are now, so that renewed ones are used; None without TLS.

        Raises:
            OSError: They cannot be used; an `ssl.SSLError` is one.
        """
        if self.certificate is None:
            return None
        context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
        context.load_cert_chain(self.certificate, self.key, password="")  # else OpenSSL asks the terminal
        return context

    def check_tls(self) -> None:
        """Refuse files by which there could be no TLS.

        Raises:
            SpecError: They cannot be used.
        """
        if self.certificate is None or self.key is None:
            return
        check_private(self.key)
        try:
            self.tls_context()
        except OSError as error:
            problem = f"{self.certificate} and {self.key} make no TLS ({error.strerror or error})"
            remedy = "give a certificate with its chain and its unencrypted private key, both PEM"
            raise SpecError("command line", "--foxglove-cert", problem, remedy) from error


def _token_in(path: Path) -> str:
    """Return the token in a file, which is made if it is missing."""
    if not path.exists():
        replace_files({path: f"{secrets.token_urlsafe(_TOKEN_BYTES)}\n".encode()})
    check_private(path)
    token = read_file(path).decode("ascii", "replace").strip()
    if not _TOKEN.fullmatch(token):
        remedy = "write 16 to 256 letters, digits, - or _ into it, or delete it to have one made"
        raise SpecError(str(path), "", "holds no token", remedy)
    return token


def _exposed(config: FoxgloveConfig, *, secured: bool) -> SpecError:
    problem = f"is {config.address}, which other machines reach, without TLS"
    own = "--foxglove-cert FILE and --foxglove-key FILE"
    remedy = (
        f"give --viewer-identity NAME (touchline keys issue viewer NAME --host ADDRESS), or {own}"
        if secured
        else f"give {own}, or --open-to-network: then anybody there looks on{', and commands' if config.orders else ''}"
    )
    return SpecError("command line", "--foxglove-listen", problem, remedy)
