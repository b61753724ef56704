"""The paper's network as an ONNX graph, from this repository's weights of it (`models/weights/faithful.safetensors`).

The dense form: a mesh's hops are products with the powers of its propagation matrix, which is faster than gathering neighbours. What depends
on the patch alone, its encoding, is computed once and kept. The layers are those of `core/src/network/faithful.rs`.
"""

from __future__ import annotations

import json
import math
import pathlib
import struct

import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, helper, numpy_helper

WEIGHTS = pathlib.Path(__file__).parents[3] / "models" / "weights" / "faithful.safetensors"
NODES_PER_SIDE, SPACING_MM, EYE_RADIUS_MM, REACH_MM = 8, 0.3, 12.0, 1.05
AROUND, RINGS, LENGTH_RADII, INSIDE = 10, 10, 10.0, 0.98
TOOL_NODES = AROUND * RINGS + 2
WIDTH, HOPS, UNIT_MM = 256, 3, 0.1


def weights() -> dict[str, np.ndarray]:
    """The tensors of the file, by name."""
    data = WEIGHTS.read_bytes()
    (size,) = struct.unpack_from("<Q", data)
    head = json.loads(data[8 : 8 + size])
    head.pop("__metadata__")
    begin = 8 + size
    return {
        name: np.frombuffer(data[begin + entry["data_offsets"][0] : begin + entry["data_offsets"][1]], "<f4").reshape(entry["shape"])
        for name, entry in head.items()
    }


def rest_mm() -> np.ndarray:
    """The macula's nodes at rest, 64 × 3."""
    line = SPACING_MM * (np.arange(NODES_PER_SIDE) - 0.5 * (NODES_PER_SIDE - 1))
    x, y = np.tile(line, NODES_PER_SIDE), np.repeat(line, NODES_PER_SIDE)
    return np.stack([x, y, EYE_RADIUS_MM - np.sqrt(EYE_RADIUS_MM**2 - x**2 - y**2)], 1).astype(np.float32)


def patch_triangles() -> np.ndarray:
    """98 triangles."""
    corners = [row * NODES_PER_SIDE + column for row in range(NODES_PER_SIDE - 1) for column in range(NODES_PER_SIDE - 1)]
    return np.array([t for a in corners for t in ((a, a + 1, a + 9), (a, a + 9, a + 8))])


def tool_mm(radius_mm: float) -> np.ndarray:
    """The nodes of a hemispherical needle's cylinder in its own frame, 102 × 3."""
    nodes = []
    for node in range(TOOL_NODES):
        ring = 0 if node == 0 else RINGS - 1 if node == TOOL_NODES - 1 else (node - 1) // AROUND
        share = 0.0 if node in (0, TOOL_NODES - 1) else INSIDE
        angle = math.tau * ((node - 1) % AROUND) / AROUND
        x, y = share * radius_mm * math.cos(angle), share * radius_mm * math.sin(angle)
        under = radius_mm - math.sqrt(radius_mm**2 - x * x - y * y)
        nodes.append([x, y, max(ring * LENGTH_RADII * radius_mm / (RINGS - 1), under)])
    return np.array(nodes, np.float32)


def tool_edges() -> list[tuple[int, int]]:
    """Along the rings, along the shaft, across each face, and from the ends' middles."""
    node = lambda ring, at: 1 + ring * AROUND + at % AROUND  # noqa: E731
    edges = []
    for at in range(AROUND):
        edges += [(0, node(0, at)), (TOOL_NODES - 1, node(RINGS - 1, at))]
        for ring in range(RINGS):
            edges.append((node(ring, at), node(ring, at + 1)))
            if ring + 1 < RINGS:
                edges += [(node(ring, at), node(ring + 1, at)), (node(ring, at), node(ring + 1, at + 1))]
    return edges


def hops(nodes: int, edges: list[tuple[int, int]]) -> list[np.ndarray]:
    """Powers 0 to 3 of the propagation matrix."""
    adjacency = np.zeros((nodes, nodes))
    for a, b in edges:
        adjacency[a, b] = adjacency[b, a] = 1.0
    root = 1.0 / np.sqrt(adjacency.sum(1))
    matrix = adjacency * root[:, None] * root[None, :]
    return [np.linalg.matrix_power(matrix, k).astype(np.float32) for k in range(HOPS + 1)]


def encoded(positions_mm: np.ndarray) -> np.ndarray:
    """Positions with three bands of sines and cosines, n × 21."""
    x = (positions_mm / REACH_MM).astype(np.float32)
    bands = [wave(np.float32(math.pi * 2**band) * x) for band in range(3) for wave in (np.sin, np.cos)]
    return np.concatenate([x, *bands], 1)


def tag(x: np.ndarray, powers: list[np.ndarray], weight: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """One TAGConv and its ReLU."""
    return np.maximum(np.concatenate([power @ x for power in powers], 1) @ weight + bias, 0.0)


def session(threads: int) -> onnxruntime.InferenceSession:
    """From the tool's numbers (102 × 25) to the displacements (64 × 3, mm)."""
    known = weights()
    triangles = patch_triangles()
    sides = [(int(a), int(b)) for t in triangles for a, b in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0]))]
    powers, soft = hops(64, sides), encoded(rest_mm())
    for layer in range(2):
        soft = tag(soft, powers, known[f"soft.{layer}.weight"], known[f"soft.{layer}.bias"])
    constants: dict[str, np.ndarray] = {"soft": soft}
    steps = []

    def step(kind: str, inputs: list[str], output: str, **attributes: int) -> str:
        steps.append(helper.make_node(kind, inputs, [output], **attributes))
        return output

    for k, power in enumerate(hops(TOOL_NODES, tool_edges())[1:], 1):
        constants[f"hop.{k}"] = power
    x = "tool"
    for layer in range(2):
        parts = [x] + [step("MatMul", [f"hop.{k}", x], f"rigid.{layer}.hop.{k}") for k in range(1, HOPS + 1)]
        joined = step("Concat", parts, f"rigid.{layer}.joined", axis=1)
        for name in ("weight", "bias"):
            constants[f"rigid.{layer}.{name}"] = known[f"rigid.{layer}.{name}"]
        summed = step("Gemm", [joined, f"rigid.{layer}.weight", f"rigid.{layer}.bias"], f"rigid.{layer}.sum")
        x = step("Relu", [summed], f"rigid.{layer}")
    across = step("Transpose", [x], "rigid.across", perm=[1, 0])
    attended = ["soft"]
    for head in range(2):
        weight = known[f"head.{head}"]
        # Query times key in one matrix, and the patch does not change: one constant.
        constants[f"query.{head}"] = soft @ (weight @ weight.T / math.sqrt(WIDTH))
        scores = step("MatMul", [f"query.{head}", across], f"scores.{head}")
        shares = step("Softmax", [scores], f"shares.{head}", axis=1)
        attended.append(step("MatMul", [shares, x], f"attended.{head}"))
    x = step("Concat", attended, "attended", axis=1)
    for layer in range(4):
        for name in ("weight", "bias"):
            constants[f"decoder.{layer}.{name}"] = known[f"decoder.{layer}.{name}"]
        x = step("Gemm", [x, f"decoder.{layer}.weight", f"decoder.{layer}.bias"], f"decoder.{layer}.sum")
        x = step("Relu", [x], f"decoder.{layer}") if layer < 3 else x
    constants["unit"] = np.array(UNIT_MM, np.float32)
    step("Mul", [x, "unit"], "displacement_mm")
    graph = helper.make_graph(
        steps,
        "paper",
        [helper.make_tensor_value_info("tool", TensorProto.FLOAT, [TOOL_NODES, 25])],
        [helper.make_tensor_value_info("displacement_mm", TensorProto.FLOAT, [64, 3])],
        [numpy_helper.from_array(np.ascontiguousarray(value, np.float32), name) for name, value in constants.items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.checker.check_model(model)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    return onnxruntime.InferenceSession(model.SerializeToString(), options, providers=["CPUExecutionProvider"])
