"""A browser's side of viser's protocol on this machine, as far as benchmarks and tests need it."""

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
from websockets.sync.client import connect

__all__ = ["Control", "LoopbackClient"]

PART = 1 << 19  # bytes of a file in one message


@dataclass
class Control:
    """Something in a panel: its `kind` is that of viser's message, such as `Slider` or `ButtonGroup`."""

    uuid: str
    kind: str
    value: Any
    props: dict[str, Any] = field(repr=False)

    @property
    def visible(self) -> bool:
        return self.props.get("visible", True)

    @property
    def text(self) -> str:
        """Markdown or HTML, empty while it is hidden."""
        return self.props.get("_markdown", self.props.get("content", "")) if self.visible else ""


class LoopbackClient:
    """Connects to a viewer; knows its controls by label and collects updates of scene nodes."""

    def __init__(self, port: int) -> None:
        self._socket = connect(
            f"ws://127.0.0.1:{port}",
            subprotocols=[f"viser-v{viser.__version__}"],  # pyright: ignore[reportArgumentType]
            max_size=None,
            compression=None,
        )
        self._controls: dict[str, Control] = {}
        self._commands: dict[str, str] = {}
        self.received = 0
        """Bytes so far."""
        self.notifications: list[str] = []
        """Notifications, the newest last."""
        self.nodes: set[str] = set()
        """Names of the scene's nodes."""
        self.downloads: dict[str, bytearray] = {}
        """Files that came, by name."""
        self._arriving: dict[str, str] = {}
        # the server calls back only for clients whose camera it knows
        camera = {
            "type": "ViewerCameraMessage",
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
        self._socket.send(msgspec.msgpack.encode(camera))
        self.collect(1.0)

    def __enter__(self) -> "LoopbackClient":
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def _send(self, kind: str, **content: Any) -> None:
        self._socket.send(msgspec.msgpack.encode({"type": kind, **content}))

    @property
    def controls(self) -> dict[str, Control]:
        """Those that are there now, by label; of several with one label the newest."""
        return {c.props["label"]: c for c in self._controls.values() if "label" in c.props and c.kind != "Folder"}

    @property
    def commands(self) -> list[str]:
        return list(self._commands)

    def set(self, label: str, value: Any) -> None:
        """Move the control of that label; a button group takes the name of the button."""
        control = self.controls[label]
        self._send("GuiUpdateMessage", uuid=control.uuid, updates={"value": value})
        control.value = value

    def click(self, label: str) -> None:
        self.set(label, True)

    def press(self, command: str) -> None:
        """Trigger a command, as its hot key does."""
        self._send("CommandTriggerMessage", uuid=self._commands[command])

    def upload(self, label: str, name: str, content: bytes) -> None:
        parts = [content[at : at + PART] for at in range(0, len(content), PART)]
        ids = {"source_component_uuid": self.controls[label].uuid, "transfer_uuid": uuid.uuid4().hex}
        about = {"filename": name, "mime_type": "", "part_count": len(parts), "size_bytes": len(content)}
        self._send("FileTransferStartUpload", **ids, **about)
        for index, part in enumerate(parts):
            self._send("FileTransferPart", **ids, part_index=index, content=part)

    def collect(self, seconds: float) -> list[dict[str, Any]]:
        """All messages of the next `seconds`."""
        out, end = [], time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            out += self.receive(left) or []
        return out

    def receive(self, timeout: float) -> list[dict[str, Any]] | None:
        """The next batch of messages, or None after `timeout` seconds."""
        try:
            raw = self._socket.recv(timeout=timeout)
        except TimeoutError:
            return None
        assert isinstance(raw, bytes)
        self.received += len(raw)
        messages = _decode(raw)
        for message in messages:
            self._note(message)
        return messages

    def until(self, holds: Callable[[], bool], seconds: float = 10.0) -> bool:
        """Listen until something holds, or for that long; whether it does."""
        end = time.monotonic() + seconds
        while not holds() and time.monotonic() < end:
            self.receive(0.1)
        return holds()

    def _note(self, message: dict[str, Any]) -> None:
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
            self._arriving[message["transfer_uuid"]] = message["filename"]
            self.downloads[message["filename"]] = bytearray()
        elif kind == "FileTransferPart" and message["transfer_uuid"] in self._arriving:
            self.downloads[self._arriving[message["transfer_uuid"]]] += message["content"]
        elif kind.startswith("Gui") and props:
            name = kind.removeprefix("Gui").removesuffix("Message")
            self._controls[message["uuid"]] = Control(message["uuid"], name, message.get("value"), props)
        elif "name" in message and "props" in message:
            self.nodes.add(message["name"])

    def _update(self, changed: str, updates: dict[str, Any]) -> None:
        control = self._controls.get(changed)
        if control is not None:
            control.value = updates.get("value", control.value)
            control.props.update({name: value for name, value in updates.items() if name in control.props})

    def text(self) -> str:
        """Everything that stands in the page, as Markdown and HTML."""
        return "\n".join(filter(None, (control.text for control in self._controls.values())))

    def wait_vertices(self, node: str, timeout: float = 5.0) -> np.ndarray | None:
        """(N, 3) of the next update of that node's vertices."""
        end = time.monotonic() + timeout
        while (left := end - time.monotonic()) > 0.0:
            for message in self.receive(left) or []:
                if message.get("name") == node and "vertices" in message.get("updates", {}):
                    return message["updates"]["vertices"].reshape(-1, 3)
        return None

    def wait_splats(self, node: str, timeout: float = 5.0) -> np.ndarray | None:
        """(N, 3) centres of the next update of that node's splats, in its own units."""
        end = time.monotonic() + timeout
        while (left := end - time.monotonic()) > 0.0:
            for message in self.receive(left) or []:
                if message.get("name") == node and "buffer" in message.get("updates", {}):
                    # 32 bytes a splat, the centre first (viser's layout)
                    words = message["updates"]["buffer"].view(np.uint32).reshape(-1, 8)
                    return np.ascontiguousarray(words[:, :3]).view(np.float32)
        return None


def _decode(raw: bytes) -> list[dict[str, Any]]:
    """Frame: two uint64 (plain and compressed size), zstd-compressed msgpack, then 8-aligned binary arrays."""
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
