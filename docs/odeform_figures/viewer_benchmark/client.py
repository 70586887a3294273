"""A client of viser's protocol on this machine, as far as benchmarks and tests need one."""

import contextlib
import io
import socket
import struct
import time
import uuid
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import msgspec
import numpy as np
import viser
import zstandard
from PIL import Image
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

__all__ = ["Control", "LoopbackClient"]

PART = 1 << 19  # bytes of a file in one message
DEADLINE = 180.0  # s, for a busy machine
CAMERA = {
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (0.0, -3.0, 1.0),
    "fov": 0.8,
    "near": 0.01,
    "far": 1000.0,
    "image_height": 600,
    "image_width": 800,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}


@dataclass
class Control:
    """A control in a panel. `kind` is that of viser's message, such as `Slider` or `ButtonGroup`."""

    uuid: str
    kind: str
    value: Any
    props: dict[str, Any] = field(repr=False)

    @property
    def visible(self) -> bool:
        """Whether the page shows it."""
        return self.props.get("visible", True)

    @property
    def text(self) -> str:
        """Markdown or HTML; empty while hidden."""
        return self.props.get("_markdown", self.props.get("content", "")) if self.visible else ""


class LoopbackClient:
    """Connects to a viewer. It keeps the controls by label, and passes on updates of scene nodes.

    It answers requests for a picture by a black one.
    """

    def __init__(self, port: int) -> None:
        """Connect to a port of this machine, and wait for the page. `TimeoutError` if it does not come."""
        self._socket = connect(
            f"ws://127.0.0.1:{port}",
            subprotocols=[f"viser-v{viser.__version__}"],  # pyright: ignore[reportArgumentType]
            max_size=None,
            compression=None,
            ping_interval=None,  # what asks whether the server is alive gives up on a busy machine
        )
        self._controls: dict[str, Control] = {}
        self._commands: dict[str, str] = {}
        self.received = 0
        """Bytes received so far."""
        self.sent = 0
        """Messages sent so far."""
        self.notifications: list[str] = []
        """Messages of notifications, the newest last."""
        self.nodes: set[str] = set()
        """Names of the scene's nodes."""
        self.downloads: dict[str, bytearray] = {}
        """Downloaded files, by name. They can be deleted at any time, also while they arrive."""
        self.drawing_s = 0.0
        """Seconds that a picture takes."""
        self._sizes: dict[str, int] = {}
        self._transfers: dict[str, str] = {}
        self._send("ViewerCameraMessage", **CAMERA)  # the server ignores clients without a camera
        if not self.until(lambda: bool(self._controls)):  # the first batch holds them all
            self._socket.close()
            raise TimeoutError(f"port {port} sent no page within {DEADLINE:g} s")

    def __enter__(self) -> "LoopbackClient":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection, as a tab does that is closed."""
        self._socket.close()

    def vanish(self) -> None:
        """Cut the connection without a word, as a killed browser does."""
        with contextlib.suppress(OSError):
            self._socket.socket.shutdown(socket.SHUT_RDWR)
        # websockets takes it for an error if it is closed while data that has arrived is still being read
        with contextlib.suppress(ConnectionClosed):
            while True:
                self._socket.recv()
        self._socket.close()

    def _send(self, kind: str, **content: Any) -> None:
        self.sent += 1
        self._socket.send(msgspec.msgpack.encode({"type": kind, **content}))

    @property
    def controls(self) -> dict[str, Control]:
        """The current controls by label; the newest, if several share a label."""
        return {c.props["label"]: c for c in self._controls.values() if "label" in c.props and c.kind != "Folder"}

    @property
    def commands(self) -> list[str]:
        """Labels of the commands that have hot keys."""
        return list(self._commands)

    def set(self, label: str, value: Any) -> None:
        """Set the value of a control; that of a button group is the label of a button. `TimeoutError` without it."""
        if not self.until(lambda: label in self.controls):  # a page may come in several batches
            raise TimeoutError(f"the page has no control {label!r}: {', '.join(self.controls)}")
        control = self.controls[label]
        self._send("GuiUpdateMessage", uuid=control.uuid, updates={"value": value})
        control.value = value

    def click(self, label: str) -> None:
        """Click a button."""
        self.set(label, True)

    def click_scene(self, origin: np.ndarray, direction: np.ndarray) -> None:
        """Click in the scene, where a ray from (3,) m along (3,) leads."""
        ray = {"ray_origin": [float(x) for x in origin], "ray_direction": [float(x) for x in direction]}
        self._send("ScenePointerMessage", event_type="click", screen_pos=[[0.5, 0.5]], modifier=None, **ray)

    def press(self, command: str) -> None:
        """Trigger a command, as its hot key does."""
        self.until(lambda: command in self._commands)
        self._send("CommandTriggerMessage", uuid=self._commands[command])

    def upload(self, label: str, name: str, content: bytes | bytearray) -> None:
        """Upload a file with the upload button of that label."""
        parts = [content[at : at + PART] for at in range(0, len(content), PART)]
        ids = {"source_component_uuid": self.controls[label].uuid, "transfer_uuid": uuid.uuid4().hex}
        about = {"filename": name, "mime_type": "", "part_count": len(parts), "size_bytes": len(content)}
        self._send("FileTransferStartUpload", **ids, **about)
        for index, part in enumerate(parts):
            self._send("FileTransferPart", **ids, part_index=index, content=part)

    def collect(self, seconds: float) -> list[dict[str, Any]]:
        """Collects all messages of the next `seconds`."""
        out, end = [], time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            out += self.receive(left) or []
        return out

    def receive(self, timeout: float) -> list[dict[str, Any]] | None:
        """Receives the next batch of messages, or None after `timeout` seconds."""
        try:
            raw = self._socket.recv(timeout=timeout)
        except TimeoutError:
            return None
        assert isinstance(raw, bytes)
        self.received += len(raw)
        messages = _decode(raw)
        for message in messages:
            self._handle(message)
        return messages

    def until(self, holds: Callable[[], bool], seconds: float = DEADLINE) -> bool:
        """Receive until a condition holds, or for at most `seconds`; returns whether it holds."""
        end = time.monotonic() + seconds
        while not (held := bool(holds())) and time.monotonic() < end:
            self.receive(0.1)
        return held

    def _handle(self, message: dict[str, Any]) -> None:
        kind, props = message["type"], message.get("props", {})
        if kind == "RegisterCommandMessage":
            self._commands[props["label"]] = message["uuid"]
        elif kind == "NotificationShowMessage":
            self.notifications.append(props["body"])
        elif kind == "GuiUpdateMessage":
            self._update(message["uuid"], message["updates"])
        elif kind == "GuiRemoveMessage":
            self._controls.pop(message["uuid"], None)
        elif kind == "RemoveSceneNodeMessage":
            self.nodes.discard(message["name"])
        elif kind == "FileTransferStartDownload":
            self._transfers[message["transfer_uuid"]] = message["filename"]
            self.downloads[message["filename"]] = bytearray()
            self._sizes[message["filename"]] = message["size_bytes"]
        elif kind == "FileTransferPart":
            self.downloads.get(self._transfers.get(message["transfer_uuid"], ""), bytearray()).extend(
                message["content"]
            )
        elif kind == "GetRenderRequestMessage":
            time.sleep(self.drawing_s)
            picture, size = io.BytesIO(), (message["width"], message["height"])
            Image.new("RGB", size).save(picture, "PNG" if message["format"] == "image/png" else "JPEG")
            self._send("GetRenderResponseMessage", payload=picture.getvalue(), render_uuid=message["render_uuid"])
        elif kind.startswith("Gui") and props:
            name = kind.removeprefix("Gui").removesuffix("Message")
            self._controls[message["uuid"]] = Control(message["uuid"], name, message.get("value"), _copied(props))
        elif "name" in message and "props" in message:
            self.nodes.add(message["name"])

    def _update(self, changed: str, updates: dict[str, Any]) -> None:
        control = self._controls.get(changed)
        if control is not None:
            control.value = updates.get("value", control.value)
            control.props.update({name: _copied(value) for name, value in updates.items() if name in control.props})

    def downloaded(self, suffix: str) -> bytes | None:
        """The first complete download whose name ends in `suffix`."""
        names = (n for n in self.downloads if n.endswith(suffix) and len(self.downloads[n]) == self._sizes[n])
        return next((bytes(self.downloads[name]) for name in names), None)

    def text(self) -> str:
        """Returns all visible Markdown and HTML of the page."""
        return "\n".join(filter(None, (control.text for control in self._controls.values())))

    def wait_vertices(self, node: str, timeout: float = DEADLINE) -> np.ndarray | None:
        """Waits for the vertices (N, 3) of the next update of a mesh node, in m; None after `timeout` seconds."""
        vertices = self._wait_update(node, "vertices", timeout)
        return None if vertices is None else vertices.reshape(-1, 3)

    def wait_splats(self, node: str, timeout: float = DEADLINE) -> np.ndarray | None:
        """Waits for the centres (N, 3) of the next update of a node of splats, in its units; None after `timeout`
        seconds."""
        buffer = self._wait_update(node, "buffer", timeout)
        if buffer is None:
            return None
        words = buffer.view(np.uint32).reshape(-1, 8)  # 32 bytes for each splat, its centre first
        return np.ascontiguousarray(words[:, :3]).view(np.float32)

    def _wait_update(self, node: str, prop: str, timeout: float) -> np.ndarray | None:
        end = time.monotonic() + timeout
        while (left := end - time.monotonic()) > 0.0:
            for message in self.receive(left) or []:
                if message.get("name") == node and prop in message.get("updates", {}):
                    return message["updates"][prop]
        return None


def _copied(value: Any) -> Any:
    """The same, whose arrays are no longer part of a message, which they would keep as a whole."""
    if isinstance(value, dict):
        return {key: _copied(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_copied(item) for item in value]
    return value.copy() if isinstance(value, np.ndarray) else value


def _decode(raw: bytes) -> list[dict[str, Any]]:
    """The messages of a frame: two uint64 (plain and compressed size), zstd-compressed msgpack, 8-aligned arrays."""
    plain, packed = struct.unpack_from("<QQ", raw, 0)
    body = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(raw[16 : 16 + packed], max_output_size=plain))
    offset, starts = 16 + packed, []
    for length in body["binaryBufferLengths"]:
        offset += -offset % 8
        starts.append(offset)
        offset += length

    def restore(value: Any) -> Any:
        if isinstance(value, dict):
            if "__binary_index" in value:
                index, kind = value["__binary_index"], np.dtype(value["dtype"])
                count = body["binaryBufferLengths"][index] // kind.itemsize
                return np.frombuffer(raw, kind, count, starts[index])
            return {key: restore(item) for key, item in value.items()}
        return [restore(item) for item in value] if isinstance(value, list) else value

    return [restore(message) for message in body["messages"]]
