"""`GET /v1/stream`: a WebSocket (RFC 6455) as far as a stream needs it, and the poses and surfaces over it."""

from __future__ import annotations

import base64
import http.client
import json
import os
import socket
import struct
from typing import Any, Dict, List, Optional, Sequence, Tuple

from ._binary import Surface, read_surface, write_pose
from ._problem import Problem, StreamClosed
from .messages import MemoryOpened, OpenSpec, Triangle

_TEXT, _BINARY, _CLOSE, _PING, _PONG = 1, 2, 8, 9, 10


class Stream:
    """A stream: `send` poses as they come and `receive` what is new, or `ask` and wait for each."""

    def __init__(self, host: str, port: int, headers: Dict[str, str], timeout_s: float, session: OpenSpec):
        self._socket = socket.create_connection((host, port), timeout_s)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._reader = self._socket.makefile("rb")
        self._sequence = 0
        self._shake_hands(host, port, headers)
        self._frame(_TEXT, json.dumps({"open": {**session, "format": "binary"}}).encode())
        opened = json.loads(self._message()[1])
        if "problem" in opened:
            self.close()
            raise Problem.of(opened["problem"]["problem"])
        self.triangles: List[Triangle] = opened["opened"]["triangles"]
        self.memory: Optional[MemoryOpened] = opened["opened"].get("memory")

    def __enter__(self) -> "Stream":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def close(self) -> None:
        """Closes the stream."""
        try:
            self._frame(_CLOSE, struct.pack(">H", 1000))
        except OSError:
            pass
        self._reader.close()
        self._socket.close()

    def send(
        self,
        tip_mm: Optional[Sequence[float]],
        force_mn: Optional[Sequence[float]] = None,
        orientation_xyzw: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
        client_time_us: float = 0.0,
        time_s: Optional[float] = None,
        volume_mm3: Optional[float] = None,
        pressure_kpa: Optional[float] = None,
    ) -> int:
        """Sends a pose and returns its number. Without a force the needle is held where it is.

        In a session with memory a pose has a time (the server's clock where it is left out), without a tip the needle is
        where the last pose left it, and the fluid on the scene's detached disc has the volume or the pressure given (as
        before where both are left out).
        """
        self._sequence += 1
        pose = write_pose(
            self._sequence, client_time_us, tip_mm, orientation_xyzw, force_mn, time_s, volume_mm3, pressure_kpa
        )
        self._frame(_BINARY, pose)
        return self._sequence

    def receive(self) -> Surface:
        """The next answer."""
        kind, message = self._message()
        if kind == _TEXT:
            raise Problem.of(json.loads(message)["problem"]["problem"])
        return read_surface(message)

    def ask(self, tip_mm: Optional[Sequence[float]], force_mn: Optional[Sequence[float]] = None, **more: Any) -> Surface:
        """Sends a pose and waits for its answer."""
        self.send(tip_mm, force_mn, **more)
        return self.receive()

    def _shake_hands(self, host: str, port: int, headers: Dict[str, str]) -> None:
        fields = {
            "Host": f"{host}:{port}",
            "Connection": "Upgrade",
            "Upgrade": "websocket",
            "Sec-WebSocket-Version": "13",
            "Sec-WebSocket-Key": base64.b64encode(os.urandom(16)).decode(),
            **headers,
        }
        lines = ["GET /v1/stream HTTP/1.1"] + [f"{name}: {value}" for name, value in fields.items()]
        self._socket.sendall("\r\n".join(lines + ["", ""]).encode())
        status = self._reader.readline()
        head = http.client.parse_headers(self._reader)
        if b" 101 " not in status:
            body = self._reader.read(int(head.get("Content-Length", 0)))
            self._socket.close()
            raise Problem.of(json.loads(body) if body else {"detail": status.decode().strip()})

    def _frame(self, kind: int, payload: bytes) -> None:
        length = len(payload)
        if length < 126:
            head = struct.pack("!BB", 0x80 | kind, 0x80 | length)
        elif length < 1 << 16:
            head = struct.pack("!BBH", 0x80 | kind, 0x80 | 126, length)
        else:
            head = struct.pack("!BBQ", 0x80 | kind, 0x80 | 127, length)
        mask = os.urandom(4)
        masked = bytes(byte ^ mask[at % 4] for at, byte in enumerate(payload))
        self._socket.sendall(head + mask + masked)

    def _message(self) -> Tuple[int, bytes]:
        """The next text or binary message; pings are answered."""
        while True:
            first, second = self._exactly(2)
            length = second & 0x7F
            if length == 126:
                (length,) = struct.unpack("!H", self._exactly(2))
            elif length == 127:
                (length,) = struct.unpack("!Q", self._exactly(8))
            payload, kind = self._exactly(length), first & 0x0F
            if kind == _PING:
                self._frame(_PONG, payload)
            elif kind == _CLOSE:
                raise StreamClosed(payload[2:].decode() or "closed")
            elif kind in (_TEXT, _BINARY):
                return kind, payload

    def _exactly(self, count: int) -> bytes:
        data = self._reader.read(count)
        if len(data) < count:
            raise StreamClosed("the connection broke off")
        return data
