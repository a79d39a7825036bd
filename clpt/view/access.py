"""Access to the page: tokens for a single use, cookies, and the names of the server."""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
import secrets
import socket

MOST_COOKIES = 64
MOST_TOKENS = 16
LOOPBACK = ("127.0.0.1", "localhost")


def is_loopback(host: str) -> bool:
    """Return whether a host is this machine alone."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def is_wildcard(host: str) -> bool:
    """Return whether a host stands for all interfaces of this machine."""
    try:
        return ipaddress.ip_address(host).is_unspecified
    except ValueError:
        return not host


def outward_address(host: str) -> str:
    """Return the address that this machine sends from to others; host: of the same family.

    127.0.0.1, or ::1, without a network. Nothing is sent.
    """
    v6 = ":" in host
    with socket.socket(socket.AF_INET6 if v6 else socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("2001:db8::1" if v6 else "192.0.2.1", 9))  # kept for documentation
            return str(probe.getsockname()[0])
        except OSError:
            return "::1" if v6 else "127.0.0.1"


class Access:
    """The secrets of a server; only their digests are kept.

    A token of 256 bits stands in an address, opens the page once, and becomes a cookie. The page is
    in a folder with a name of 128 bits: browsers send a cookie to all ports of a host, some perhaps
    a stranger's, but only for the folder of the cookie.
    """

    def __init__(self, port: int):
        self.cookie_name = f"clpt-{port}"
        self.room = f"/{secrets.token_urlsafe(16)}/"
        self._tokens: list[bytes] = []
        self._cookies: list[bytes] = []

    def new_token(self) -> str:
        """Return a token that opens the page once."""
        token = secrets.token_urlsafe(32)
        self._tokens = [*self._tokens, _digest(token)][-MOST_TOKENS:]
        return token

    def exchange(self, token: str) -> str | None:
        """Return a new cookie's value for a token, which is used up; None for a wrong token."""
        token_digest = _find(token, self._tokens)
        if token_digest is None:
            return None
        self._tokens.remove(token_digest)
        cookie = secrets.token_urlsafe(32)
        self._cookies = [*self._cookies, _digest(cookie)][-MOST_COOKIES:]
        return cookie

    def allows(self, cookies: str) -> bool:
        """Return whether a header `Cookie` has a cookie of this server."""
        for part in cookies.split(";"):
            name, _, value = part.strip().partition("=")
            if name == self.cookie_name and _find(value, self._cookies) is not None:
                return True
        return False


def _digest(secret: str) -> bytes:
    return hashlib.sha256(secret.encode("utf-8", "surrogateescape")).digest()


def _find(secret: str, known: list[bytes]) -> bytes | None:
    """Return the digest of a secret among known digests, in a time that does not depend on them."""
    digest = _digest(secret)
    equal = [other for other in known if hmac.compare_digest(other, digest)]
    return equal[0] if equal else None
