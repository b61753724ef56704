"""The service over HTTP."""

from __future__ import annotations

import http.client
import json
import urllib.parse
from typing import Any, Iterator, Mapping, Optional, Tuple, cast

from ._problem import Problem
from ._stream import Stream
from .messages import (
    About,
    BatchRequest,
    BatchResponse,
    OpenSpec,
    PredictRequest,
    PredictResponse,
    SceneList,
    SimulateLine,
    SimulateRequest,
)


class Service:
    """A service at an address, with a token where it wants one."""

    def __init__(self, url: str = "http://127.0.0.1:8080", token: Optional[str] = None, timeout_s: float = 60.0):
        parts = urllib.parse.urlsplit(url)
        if parts.scheme != "http" or not parts.hostname:
            raise ValueError(f"{url} is not http://host:port")
        self._host, self._port = parts.hostname, parts.port or 80
        self._headers = {"Authorization": f"Bearer {token}"} if token else {}
        self._timeout_s = timeout_s

    def predict(self, request: PredictRequest) -> PredictResponse:
        """`POST /v1/predict`."""
        return cast(PredictResponse, self._ask("POST", "/v1/predict", request))

    def predict_batch(self, request: BatchRequest) -> BatchResponse:
        """`POST /v1/predict/batch`; each of `answers` has `prediction` or `problem`."""
        return cast(BatchResponse, self._ask("POST", "/v1/predict/batch", request))

    def about(self) -> About:
        """`GET /v1/about`."""
        return cast(About, self._ask("GET", "/v1/about", None))

    def simulate(self, request: SimulateRequest) -> Iterator[SimulateLine]:
        """`POST /v1/simulate`: its lines as they come."""
        connection, response = self._send("POST", "/v1/simulate", request)
        try:
            if response.status != 200:
                raise Problem.of(json.loads(response.read()))
            for line in response:
                yield json.loads(line)
        finally:
            connection.close()

    def stream(self, session: Optional[OpenSpec] = None) -> Stream:
        """`GET /v1/stream`, opened with `scene`, `needle`, `accuracy`, `effects`, `memory`."""
        return Stream(self._host, self._port, self._headers, self._timeout_s, session or {})

    def scenes(self) -> SceneList:
        """`GET /v1/scenes`: the built-in scenes, and every parameter with its range."""
        return cast(SceneList, self._ask("GET", "/v1/scenes", None))

    def _send(
        self, method: str, path: str, body: Optional[Mapping[str, Any]]
    ) -> Tuple[http.client.HTTPConnection, http.client.HTTPResponse]:
        connection = http.client.HTTPConnection(self._host, self._port, timeout=self._timeout_s)
        headers = dict(self._headers)
        if body is not None:
            headers["Content-Type"] = "application/json"
        connection.request(method, path, None if body is None else json.dumps(body), headers)
        return connection, connection.getresponse()

    def _ask(self, method: str, path: str, body: Optional[Mapping[str, Any]]) -> object:
        connection, response = self._send(method, path, body)
        try:
            answer = json.loads(response.read())
        finally:
            connection.close()
        if response.status != 200:
            raise Problem.of(answer)
        return answer
