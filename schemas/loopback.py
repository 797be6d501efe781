"""Hosts that are this machine, and which other machines cannot reach."""

import ipaddress


def is_loopback_host(host: str) -> bool:
    """Return whether a host is this machine's loopback.

    Args:
        host: Name or IP address, an IPv6 one without brackets.
    """
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
