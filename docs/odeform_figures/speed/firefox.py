"""Firefox, driven by its own protocol (Marionette), which needs nothing but Firefox itself.

Where there is no display it needs a virtual one, as of `xvfb-run -a`: without a window Firefox has no WebGL.
"""

import json
import os
import re
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from odeform.errors import InputError

__all__ = ["FIREFOX", "Firefox", "open_firefox"]

FIREFOX = os.environ.get("FIREFOX") or shutil.which("firefox-esr") or shutil.which("firefox")
START = 120.0  # s, for a busy machine
SCRIPT_MS = 300_000
PREFERENCES = {
    "devtools.console.stdout.content": True,
    "browser.dom.window.dump.enabled": True,
    "webgl.force-enabled": True,
    "datareporting.policy.dataSubmissionEnabled": False,
    "browser.shell.checkDefaultBrowser": False,
}
OWN = re.compile(r"RSLoader|resource://|chrome://")  # of Firefox itself
COMPLAINTS = ("JavaScript error", "JavaScript warning", "console.error", "console.warn")


class Firefox:
    """One page of a browser."""

    def __init__(self, connection: socket.socket, log: Path) -> None:
        self._connection, self._stream, self._log = connection, connection.makefile("rb"), log
        self._count = 0
        self._read()  # its greeting
        self._call("WebDriver:NewSession", {})
        self._call("WebDriver:SetTimeouts", {"script": SCRIPT_MS, "pageLoad": SCRIPT_MS})

    def open(self, address: str, size: tuple[int, int]) -> None:
        """Load `address` in a window whose page has about `size` pixels."""
        self._call("WebDriver:SetWindowRect", {"width": size[0], "height": size[1]})
        self._call("WebDriver:Navigate", {"url": address})

    def evaluate(self, function: str, argument: Any) -> Any:
        """The value of an asynchronous JavaScript function of one argument."""
        script = f"const [argument, done] = arguments; ({function})(argument).then(done);"
        return self._call("WebDriver:ExecuteAsyncScript", {"script": script, "args": [argument]})["value"]

    def complaints(self) -> list[str]:
        """Errors and warnings on the console since the browser began."""
        lines = self._log.read_text(errors="replace").splitlines()
        return [line for line in lines if line.startswith(COMPLAINTS) and not OWN.search(line)]

    def _call(self, command: str, parameters: dict[str, Any]) -> Any:
        self._count += 1
        message = json.dumps([0, self._count, command, parameters]).encode()
        self._connection.sendall(f"{len(message)}:".encode() + message)
        _, _, error, result = self._read()
        if error:
            raise RuntimeError(f"{command}: {error['message']}")
        return result

    def _read(self) -> Any:
        length = b""
        while not length.endswith(b":"):
            length += self._stream.read(1)
        return json.loads(self._stream.read(int(length[:-1])))


@contextmanager
def open_firefox() -> Iterator[Firefox]:
    """A browser with a profile of its own. `InputError` without Firefox, `TimeoutError` if it does not start."""
    if FIREFOX is None:
        raise InputError("expected Firefox on the PATH, or its path in the environment variable FIREFOX")
    with tempfile.TemporaryDirectory(prefix="odeform-firefox-") as folder:
        profile, log = Path(folder), Path(folder) / "console.txt"
        lines = (f"user_pref({json.dumps(name)}, {json.dumps(value)});" for name, value in PREFERENCES.items())
        (profile / "user.js").write_text("\n".join(lines))
        command = [FIREFOX, "--marionette", "--no-remote", "--profile", folder]
        with log.open("wb") as output:
            browser = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)
        try:
            with socket.create_connection(("127.0.0.1", _port(profile))) as connection:
                yield Firefox(connection, log)
        finally:
            browser.terminate()
            browser.wait()


def _port(profile: Path) -> int:
    """The port at which the browser of that profile listens; it writes it there."""
    end, file = time.monotonic() + START, profile / "MarionetteActivePort"
    while time.monotonic() < end:
        if file.exists() and (text := file.read_text().strip()):
            return int(text)
        time.sleep(0.1)
    raise TimeoutError(f"Firefox did not start within {START:g} s")
