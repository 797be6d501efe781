"""Reasons why a secured bus cannot be joined, by a TLS handshake alone: Zenoh reports all of them as a timeout."""

import socket
import ssl
from typing import Final

from touchline.security.access_list import address_of
from touchline.security.identity import Identity

_PATIENCE_S: Final = 2.0
#: By OpenSSL's codes (X509_V_ERR_…) of a certificate that we refuse; all others mean another authority.
_OURS: Final = {
    9: "has a certificate that is not valid yet; compare the clocks of both machines",
    10: "has an expired certificate; renew it, or compare the clocks of both machines",
    26: "has a certificate of none that others may connect to; it is no router",
    62: "has a certificate for other hosts; issue one with --host",
    64: "has a certificate for other hosts; issue one with --host",
}
#: By the alerts of those who refuse our certificate.
_THEIRS: Final = {
    "CERTIFICATE_REQUIRED": "asks for a certificate; give an identity: --identity",
    # It sends this for a certificate of the future, too.
    "CERTIFICATE_EXPIRED": "finds {name} expired, or not valid yet; compare the clocks of both machines, or renew it",
    "UNKNOWN_CA": "has another authority than {name}; use an identity of that authority",
    "DECRYPT_ERROR": "has another authority than {name}; use an identity of that authority",
}


def why_refused(endpoint: str, identity: Identity | None) -> str:
    """Return in a sentence why nobody can join there; empty if TLS is not the reason.

    Args:
        endpoint: Where to join: ``tls/HOST:PORT``.
        identity: Of whoever wants to join.

    Raises:
        ValueError: It is no such endpoint.
    """
    host, port = address_of(endpoint)
    if not endpoint.startswith("tls/"):
        raise ValueError("give an endpoint like tls/10.0.0.1:7461")
    try:
        context = _context(identity)
    except OSError as error:
        return f"the identity's files cannot be read any more ({error.strerror or error}); is it revoked?"
    try:
        connection = socket.create_connection((host, port), _PATIENCE_S)
    except OSError as error:
        return f"nobody listens at {endpoint} ({error.strerror or error})"
    with connection:
        reason = _refusal(context, connection, host, identity)
    return f"{endpoint} {reason}" if reason else ""


def _refusal(context: ssl.SSLContext, connection: socket.socket, host: str, identity: Identity | None) -> str:
    try:
        secured = context.wrap_socket(connection, server_hostname=host)
    except ssl.SSLCertVerificationError as error:
        return _OURS.get(error.verify_code, "has a certificate of another authority; use an identity of that authority")
    except ssl.SSLError as error:
        return f"speaks no TLS that we understand ({_alert(error)})"
    except OSError:  # no answer, or cut off
        return "speaks no TLS, or hangs; stop what listens there, and start the router"
    with secured:
        try:
            secured.recv(1)  # in TLS 1.3 our certificate is refused after the handshake
        except ssl.SSLError as error:
            alert = _alert(error)
            told = next((text for name, text in _THEIRS.items() if name in alert), f"refuses {{name}} ({alert})")
            return told.format(name=identity.name if identity else "a stranger")
        except OSError:  # it waits for our first message: we are accepted
            pass
    return ""


def _context(identity: Identity | None) -> ssl.SSLContext:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    if identity is None:
        context.check_hostname = False
        context.verify_mode = ssl.CERT_NONE
    else:
        context.load_verify_locations(identity.authority)
        context.load_cert_chain(identity.certificate, identity.key)
    return context


def _alert(error: ssl.SSLError) -> str:
    """Return OpenSSL's name of an error, without the version of the protocol: ``CERTIFICATE_REQUIRED``."""
    return (error.reason or str(error)).partition("ALERT_")[2] or str(error.reason)
