"""Only pages of this machine, and those that the user names, reach the viewer."""

import http.client
from collections.abc import Iterator

import pytest
import viser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from odeform.errors import InputError
from odeform_viz.runtime.access import Access, is_loopback, reachable_address
from odeform_viz.runtime.server import open_server, stop_server

LOCAL = Access()
PROXIED = Access.of("127.0.0.1", ["https://lab.example"])
EXPOSED = Access.of("0.0.0.0", ["http://workstation:8080"])


@pytest.mark.parametrize(
    ("access", "host", "origin"),
    [
        (LOCAL, "127.0.0.1:8080", "http://127.0.0.1:8080"),
        (LOCAL, "localhost:8080", "http://localhost:9000"),
        (LOCAL, "[::1]:8080", "http://[::1]:8080"),
        (LOCAL, "127.0.0.1:8080", None),
        (PROXIED, "lab.example", "https://lab.example"),
        (PROXIED, "127.0.0.1:8080", "https://lab.example:443"),
        (EXPOSED, "192.168.0.7:8080", "http://192.168.0.7:8080"),
        (EXPOSED, "workstation:8080", "http://workstation:8080"),
    ],
)
def test_accepted(access: Access, host: str, origin: str | None) -> None:
    assert access.refusal([host], [] if origin is None else [origin]) == ""


@pytest.mark.parametrize(
    ("access", "host", "origin"),
    [
        (LOCAL, "127.0.0.1:8080", "https://evil.example"),
        (LOCAL, "127.0.0.1:8080", "null"),
        (LOCAL, "127.0.0.1:8080", ""),
        (LOCAL, "127.0.0.1:8080", "http://127.0.0.1.evil.example"),
        (LOCAL, "127.0.0.1:8080", "http://localhost@evil.example"),
        (LOCAL, "evil.example:8080", None),
        (LOCAL, "evil.example:8080", "http://evil.example:8080"),
        (LOCAL, "127.0.0.1:x", None),
        (LOCAL, "192.168.0.7:8080", None),
        (PROXIED, "lab.example", "http://lab.example"),
        (PROXIED, "lab.example", "https://lab.example:8443"),
        (EXPOSED, "192.168.0.7:8080", "http://192.168.0.7:9000"),
        (EXPOSED, "evil.example:8080", "http://evil.example:8080"),
    ],
)
def test_refused(access: Access, host: str, origin: str | None) -> None:
    assert "--allow-origin" in access.refusal([host], [] if origin is None else [origin])


def test_headers_that_are_missing_or_repeated_are_refused() -> None:
    assert LOCAL.refusal([], [])
    assert LOCAL.refusal(["127.0.0.1", "127.0.0.1"], [])
    assert LOCAL.refusal(["127.0.0.1"], ["http://127.0.0.1", "http://127.0.0.1"])


@pytest.mark.parametrize("origin", ["*", "lab.example", "https://lab.example/page", "ftp://lab.example", "https://a:b"])
def test_an_origin_is_a_scheme_and_a_host(origin: str) -> None:
    with pytest.raises(InputError, match="--allow-origin: expected SCHEME"):
        Access.of("127.0.0.1", [origin])


def test_loopback() -> None:
    assert all(is_loopback(host) for host in ("localhost", "127.0.0.1", "127.8.9.1", "::1"))
    assert not any(is_loopback(host) for host in ("0.0.0.0", "::", "192.168.0.7", "lab.example", ""))
    assert reachable_address("127.0.0.1") == "127.0.0.1"
    assert reachable_address("0.0.0.0") not in ("0.0.0.0", "127.0.0.1")


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    server = open_server(LOCAL, 0, "test")
    yield server
    stop_server(server)


def _status(server: viser.ViserServer, **headers: str) -> int:
    connection = http.client.HTTPConnection("127.0.0.1", server.get_port(), timeout=60.0)
    try:
        connection.request("GET", "/", headers=headers)
        return connection.getresponse().status
    finally:
        connection.close()


def test_a_foreign_page_gets_no_page_and_no_state(server: viser.ViserServer) -> None:
    assert _status(server) == 200
    assert _status(server, Host="evil.example") == 403
    assert _status(server, Origin="https://evil.example") == 403
    port, version = server.get_port(), [f"viser-v{viser.__version__}"]
    for more in ({"origin": "https://evil.example"}, {"additional_headers": {"Host": "evil.example"}}):
        with pytest.raises(InvalidStatus) as refused:
            connect(f"ws://127.0.0.1:{port}", subprotocols=version, **more)  # pyright: ignore
        assert refused.value.response.status_code == 403
    assert not server.get_clients()
    with connect(f"ws://127.0.0.1:{port}", subprotocols=version, origin=f"http://127.0.0.1:{port}") as client:  # pyright: ignore
        assert client.recv(timeout=60.0)
