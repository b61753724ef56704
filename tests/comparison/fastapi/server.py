"""A FastAPI server around the paper's network: `python server.py PORT`. It answers `POST /v1/predict` as far as that network can.

What a careful author of such a service would do: pydantic reads the request, numpy makes the features, ONNX Runtime evaluates the network on one
thread a request, orjson writes the answer, uvicorn with its faster loop serves. Handlers are plain functions, which FastAPI runs on a pool of threads, so
both cores work.
"""

from __future__ import annotations

import sys
from typing import List, Optional

import numpy as np
import uvicorn
from fastapi import FastAPI
from fastapi.responses import ORJSONResponse, Response
from pydantic import BaseModel

import network

try:
    import orjson
except ImportError as error:
    raise SystemExit(f"{error}; see README.md") from error

RADIUS_MM = 0.257
REST_MM = network.rest_mm()
TRIANGLES = network.patch_triangles()
TRIANGLE_LIST = TRIANGLES.tolist()
TOOL_MM = network.tool_mm(RADIUS_MM)
SESSION = network.session(threads=1)


class Needle(BaseModel):
    tip_mm: List[float]


class Accuracy(BaseModel):
    level: Optional[str] = None


class Request(BaseModel):
    needle: Needle
    force_mn: List[float]
    accuracy: Optional[Accuracy] = None


app = FastAPI()


def displaced(tip_mm: List[float], force_mn: List[float]) -> np.ndarray:
    """The nodes' displacements under a needle that points straight down (mm)."""
    force = np.array(force_mn, np.float32)
    size = float(np.linalg.norm(force))
    x, y = tip_mm[0], tip_mm[1]
    # The tool where it first touches.
    touch = network.EYE_RADIUS_MM - np.sqrt(network.EYE_RADIUS_MM**2 - x * x - y * y)
    tool = TOOL_MM + np.array([x, y, touch], np.float32)
    first = np.tile(np.append(force / max(size, 1e-12), size).astype(np.float32), (network.TOOL_NODES, 1))
    features = np.concatenate([first, network.encoded(tool)], 1)
    return SESSION.run(None, {"tool": features})[0]


def normals(vertices: np.ndarray) -> np.ndarray:
    """Unit normals at the nodes."""
    a, b, c = (vertices[TRIANGLES[:, corner]] for corner in range(3))
    faces = np.cross(b - a, c - a)
    sums = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(sums, TRIANGLES[:, corner], faces)
    return sums / np.linalg.norm(sums, axis=1, keepdims=True)


@app.post("/v1/predict", response_class=ORJSONResponse)
def predict(request: Request) -> Response:
    moved = displaced(request.needle.tip_mm, request.force_mn)
    vertices = REST_MM + moved
    surface = {
        "vertices_mm": vertices,
        "normals": normals(vertices),
        "triangles": TRIANGLE_LIST,
        "displacement_um": 1000.0 * np.linalg.norm(moved, axis=1),
    }
    body = orjson.dumps({"surface": surface, "accuracy": {"level": "paper"}}, option=orjson.OPT_SERIALIZE_NUMPY)
    return Response(body, media_type="application/json")


if __name__ == "__main__":
    uvicorn.run(app, host="127.0.0.1", port=int(sys.argv[1]), log_level="warning", access_log=False)
