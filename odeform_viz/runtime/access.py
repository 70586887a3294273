"""Decides which addresses and pages may reach the viewer: those of this machine, and those that the user names.

A browser lets any website open a websocket to 127.0.0.1, and sends the website's name as `Origin`: that keeps it out.
The `Host` keeps out a website whose name was made to resolve to 127.0.0.1 (DNS rebinding).
"""

import ipaddress
import socket
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from urllib.parse import SplitResult, urlsplit

from odeform.errors import InputError

__all__ = ["Access", "is_loopback", "reachable_address"]

PORTS = {"http": 80, "https": 443}
NOWHERE = ("192.0.2.1", 9)  # an address for documentation, RFC 5737


def is_loopback(host: str) -> bool:
    """Whether a name or an address, without a port, is that of this machine and of no other."""
    if host.rstrip(".").lower() == "localhost":
        return True
    address = _address(host)
    return address is not None and address.is_loopback


def reachable_address(host: str) -> str:
    """An address at which other machines may reach a server on `host`; `host` itself unless it means any address.

    Nothing is sent: connecting a datagram socket only selects the network.
    """
    address = _address(host)
    if address is None or not address.is_unspecified:
        return host
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(NOWHERE)
            return probe.getsockname()[0]
        except OSError:  # no network
            return socket.gethostname()


@dataclass(frozen=True)
class Access:
    """Returns what a server on `host` accepts; `origins` are pages of other addresses, as
    `https://lab.example:8443`."""

    host: str = "127.0.0.1"
    origins: frozenset[tuple[str, str, int]] = frozenset()
    """Scheme, name and port of each."""

    @classmethod
    def of(cls, host: str, origins: Iterable[str] = ()) -> "Access":
        """Raises `InputError` for an origin that is not SCHEME://HOST or SCHEME://HOST:PORT."""
        return cls(host, frozenset(_parsed(origin) for origin in origins))

    def refusal(self, hosts: Sequence[str], origins: Sequence[str]) -> str:
        """Why a request with these values of the headers `Host` and `Origin` is refused; empty if it is accepted."""
        if len(hosts) != 1 or (name := _name(hosts[0])) is None or not self._accepts_host(name):
            return "this Host is not allowed; open the address that odeform-viz printed, or name it by --allow-origin"
        # programs that are not browsers send no origin
        if origins and (len(origins) > 1 or not self._accepts_origin(origins[0], hosts[0])):
            return "this Origin is not allowed; name it by --allow-origin"
        return ""

    def _accepts_host(self, name: str) -> bool:
        if is_loopback(name) or name in {origin[1] for origin in self.origins}:
            return True
        # an exposed server is reached by addresses, which cannot be rebound, or by the name that it was given
        return not is_loopback(self.host) and (_address(name) is not None or name == self.host.lower())

    def _accepts_origin(self, origin: str, host: str) -> bool:
        try:
            scheme, name, port = _parsed(origin)
        except InputError:  # "null" among others
            return False
        if is_loopback(name) or (scheme, name, port) in self.origins:
            return True
        return not is_loopback(self.host) and urlsplit(f"//{host}").netloc.lower() == urlsplit(origin).netloc.lower()


def _parsed(origin: str) -> tuple[str, str, int]:
    """Scheme, name and port of an origin."""
    wrong = InputError(f"--allow-origin: expected SCHEME://HOST[:PORT], as https://lab.example, got {origin!r}")
    try:
        parts = urlsplit(origin)
        port = parts.port
    except ValueError:
        raise wrong from None
    if parts.scheme not in PORTS or not parts.hostname or _rest(parts) or "*" in origin:
        raise wrong
    return parts.scheme, parts.hostname, PORTS[parts.scheme] if port is None else port


def _rest(parts: SplitResult) -> str:
    """All of an address that an origin does not have."""
    return parts.path.strip("/") + parts.query + parts.fragment + (parts.username or "")


def _name(host: str) -> str | None:
    """The name in a Host header, without its port; None for a malformed one."""
    try:
        parts = urlsplit(f"//{host}")
        _ = parts.port
    except ValueError:
        return None
    return parts.hostname if not _rest(parts) else None


def _address(host: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(host)
    except ValueError:
        return None
