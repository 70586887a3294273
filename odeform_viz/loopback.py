"""A browser's side of viser's protocol on this machine, as far as benchmarks and tests need it."""

import struct
import time
from typing import Any

import msgspec
import numpy as np
import viser
import zstandard
from websockets.sync.client import connect

__all__ = ["LoopbackClient"]


class LoopbackClient:
    """Connects to a viewer; knows its controls by label and collects updates of scene nodes."""

    def __init__(self, port: int) -> None:
        self._socket = connect(
            f"ws://127.0.0.1:{port}",
            subprotocols=[f"viser-v{viser.__version__}"],  # pyright: ignore[reportArgumentType]
            max_size=None,
            compression=None,
        )
        self.controls: dict[str, str] = {}
        self.texts: dict[str, str] = {}
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

    def set(self, label: str, value: Any) -> None:
        """Move the control of that label."""
        message = {"type": "GuiUpdateMessage", "uuid": self.controls[label], "updates": {"value": value}}
        self._socket.send(msgspec.msgpack.encode(message))

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
        messages = _decode(raw)
        for message in messages:
            self._note(message)
        return messages

    def _note(self, message: dict[str, Any]) -> None:
        props = message.get("props", {})
        if isinstance(props, dict) and "label" in props and "uuid" in message:
            self.controls[props["label"]] = message["uuid"]
        if message["type"] == "GuiMarkdownMessage":
            self.texts[message["uuid"]] = props["_markdown"]
        if message["type"] == "GuiUpdateMessage" and message["uuid"] in self.texts:
            self.texts[message["uuid"]] = message["updates"].get("_markdown", self.texts[message["uuid"]])

    def text(self) -> str:
        """Everything that stands in the page's Markdown."""
        return "\n".join(self.texts.values())

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
