"""A client of the retina service: Python 3.9 or newer, the standard library alone.

    service = Service("http://127.0.0.1:8080")
    answer = service.predict({"needle": {"tip_mm": [0.12, -0.05, 0.0]}, "force_mn": [0, 0, -0.4]})

    with service.stream(accuracy={"level": "linear"}) as stream:
        surface = stream.ask(tip_mm=[0.12, -0.05, 0.0], force_mn=[0, 0, -0.4])

Units are mm, mN and kPa, errors in µm; +z points out of the tissue. What the service refuses is raised as `Problem`.
Streams speak the binary layout that `server/src/stream/binary.rs` documents.
"""

from __future__ import annotations

import base64
import http.client
import json
import os
import socket
import struct
import urllib.parse
from dataclasses import dataclass
from typing import Any, Iterator, Optional, Sequence

_HEADER = struct.Struct("<4sBBHQd")
_POSE = struct.Struct("<3f4f3f")
_ANSWER = struct.Struct("<IBBHdff3ff3fffffffI3I")
_LEVELS = ("linear", "coarse", "reference", "network", "corrected")
_CONTACTS = ("clear", "touching", "slipping", "punctured")
_TEXT, _BINARY, _CLOSE, _PING, _PONG = 1, 2, 8, 9, 10


class Problem(Exception):
    """What the service refused, and why: `document` is the problem document (RFC 9457)."""

    def __init__(self, document: dict):
        super().__init__(document.get("detail", "no detail"))
        self.document = document


class StreamClosed(Exception):
    """The service has closed the stream."""


@dataclass
class Surface:
    """The answer to a pose of a stream. Lists of nodes are in the order of `Stream.triangles`."""

    sequence: int
    client_time_us: float
    dropped: int  # poses since the last answer that a newer one overtook
    level: str
    contact: str
    calibrated: bool
    warned: bool
    received_us: float  # the server's clock; it began with the stream
    waited_us: float
    computed_us: float
    tip_mm: tuple
    travel_mm: float
    reaction_mn: tuple
    area_mm2: float
    max_strain: float
    max_pressure_kpa: float
    max_penetration_um: float
    expected_error_um: tuple  # median and 95 %; NaN where unknown
    vertices_mm: list
    normals: list
    displacement_um: tuple
    triangles: Optional[list]  # of a patch that is cut from a mesh
    source_indices: Optional[tuple]


class Service:
    """A service at an address, with a token where it wants one."""

    def __init__(self, url: str = "http://127.0.0.1:8080", token: Optional[str] = None, timeout_s: float = 60.0):
        parts = urllib.parse.urlsplit(url)
        if parts.scheme != "http" or not parts.hostname:
            raise ValueError(f"{url} is not http://host:port")
        self._host, self._port = parts.hostname, parts.port or 80
        self._headers = {"Authorization": f"Bearer {token}"} if token else {}
        self._timeout_s = timeout_s

    def predict(self, request: dict) -> dict:
        """`POST /v1/predict`."""
        return self._ask("POST", "/v1/predict", request)

    def predict_batch(self, request: dict) -> dict:
        """`POST /v1/predict/batch`; each of `answers` has `prediction` or `problem`."""
        return self._ask("POST", "/v1/predict/batch", request)

    def about(self) -> dict:
        """`GET /v1/about`."""
        return self._ask("GET", "/v1/about", None)

    def simulate(self, request: dict) -> Iterator[dict]:
        """`POST /v1/simulate`: its lines as they come."""
        connection, response = self._send("POST", "/v1/simulate", request)
        try:
            if response.status != 200:
                raise Problem(json.loads(response.read()))
            for line in response:
                yield json.loads(line)
        finally:
            connection.close()

    def stream(self, **session: Any) -> "Stream":
        """`GET /v1/stream`, opened with `scene`, `needle`, `accuracy`, `effects`."""
        return Stream(self._host, self._port, self._headers, self._timeout_s, session)

    def _send(self, method: str, path: str, body: Optional[dict]):
        connection = http.client.HTTPConnection(self._host, self._port, timeout=self._timeout_s)
        headers = dict(self._headers)
        if body is not None:
            headers["Content-Type"] = "application/json"
        connection.request(method, path, None if body is None else json.dumps(body), headers)
        return connection, connection.getresponse()

    def _ask(self, method: str, path: str, body: Optional[dict]) -> dict:
        connection, response = self._send(method, path, body)
        try:
            answer = json.loads(response.read())
        finally:
            connection.close()
        if response.status != 200:
            raise Problem(answer)
        return answer


class Stream:
    """A stream: `send` poses as they come and `receive` what is new, or `ask` and wait for each."""

    def __init__(self, host: str, port: int, headers: dict, timeout_s: float, session: dict):
        self._socket = socket.create_connection((host, port), timeout_s)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._reader = self._socket.makefile("rb")
        self._sequence = 0
        self._shake_hands(host, port, headers)
        self._frame(_TEXT, json.dumps({"open": {**session, "format": "binary"}}).encode())
        opened = json.loads(self._message()[1])
        if "problem" in opened:
            self.close()
            raise Problem(opened["problem"]["problem"])
        self.triangles: list = opened["opened"]["triangles"]

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
        tip_mm: Sequence[float],
        force_mn: Optional[Sequence[float]] = None,
        orientation_xyzw: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
        client_time_us: float = 0.0,
    ) -> int:
        """Sends a pose and returns its number. Without a force the needle is held where it is."""
        self._sequence += 1
        flags = 0 if force_mn is None else 1
        header = _HEADER.pack(b"RTNA", 1, 1, flags, self._sequence, client_time_us)
        self._frame(_BINARY, header + _POSE.pack(*tip_mm, *orientation_xyzw, *(force_mn or (0.0, 0.0, 0.0))))
        return self._sequence

    def receive(self) -> Surface:
        """The next answer."""
        kind, message = self._message()
        if kind == _TEXT:
            raise Problem(json.loads(message)["problem"]["problem"])
        return _surface(message)

    def ask(self, tip_mm: Sequence[float], force_mn: Optional[Sequence[float]] = None, **more: Any) -> Surface:
        """Sends a pose and waits for its answer."""
        self.send(tip_mm, force_mn, **more)
        return self.receive()

    def _shake_hands(self, host: str, port: int, headers: dict) -> None:
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
            raise Problem(json.loads(body) if body else {"detail": status.decode().strip()})

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

    def _message(self) -> tuple:
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


def _surface(message: bytes) -> Surface:
    magic, version, kind, flags, sequence, time_us = _HEADER.unpack_from(message)
    if (magic, version, kind) != (b"RTNA", 1, 2):
        raise ValueError("not an answer of layout 1")
    f = _ANSWER.unpack_from(message, _HEADER.size)
    count, at = f[3], _HEADER.size + _ANSWER.size
    numbers = struct.unpack_from(f"<{7 * count}f", message, at)
    at += 28 * count
    triangles, source = None, None
    if flags & 4:
        (pieces,) = struct.unpack_from("<I", message, at)
        corners = struct.unpack_from(f"<{3 * pieces}I", message, at + 4)
        triangles = [corners[k : k + 3] for k in range(0, 3 * pieces, 3)]
        source = struct.unpack_from(f"<{count}I", message, at + 4 + 12 * pieces)
    triples = [numbers[k : k + 3] for k in range(0, 6 * count, 3)]
    return Surface(
        sequence=sequence,
        client_time_us=time_us,
        dropped=f[0],
        level=_LEVELS[f[1]],
        contact=_CONTACTS[f[2]],
        calibrated=bool(flags & 1),
        warned=bool(flags & 2),
        received_us=f[4],
        waited_us=f[5],
        computed_us=f[6],
        tip_mm=f[7:10],
        travel_mm=f[10],
        reaction_mn=f[11:14],
        area_mm2=f[14],
        max_strain=f[15],
        max_pressure_kpa=f[16],
        max_penetration_um=f[17],
        expected_error_um=f[18:20],
        vertices_mm=triples[:count],
        normals=triples[count:],
        displacement_um=numbers[6 * count :],
        triangles=triangles,
        source_indices=source,
    )
