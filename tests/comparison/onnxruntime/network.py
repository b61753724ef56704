"""The paper's network as ONNX graphs, from this repository's weights of it (`models/weights/faithful.safetensors`).

Two graphs of the same network: `whole` takes the numbers of both bodies, as the publication does; `kept` takes the tool's alone and holds what depends on the patch
as constants, as `core/src/network/faithful.rs` does. Both are the dense form: a mesh's hops are products with the powers of its propagation matrix,
which ONNX Runtime computes faster than gathers and scatters.
"""

from __future__ import annotations

import json
import math
import struct

import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, helper, numpy_helper

PATCH_NODES, TOOL_NODES, SOFT, RIGID = 64, 102, 21, 25
WIDTH, HOPS, HEADS, LAYERS, UNIT_MM = 256, 3, 2, 4, 0.1


def weights(path: str) -> dict[str, np.ndarray]:
    """The tensors of a safetensors file, by name."""
    with open(path, "rb") as file:
        data = file.read()
    (size,) = struct.unpack_from("<Q", data)
    head = json.loads(data[8 : 8 + size])
    head.pop("__metadata__", None)
    begin = 8 + size

    def tensor(entry: dict) -> np.ndarray:
        first, last = entry["data_offsets"]
        return np.frombuffer(data[begin + first : begin + last], "<f4").reshape(entry["shape"])

    return {name: tensor(entry) for name, entry in head.items()}


def powers(nodes: int, edges: np.ndarray) -> list[np.ndarray]:
    """Powers 1 to 3 of the propagation matrix of directed edges."""
    adjacency = np.zeros((nodes, nodes))
    adjacency[edges[:, 0], edges[:, 1]] = 1.0
    root = 1.0 / np.sqrt(adjacency.sum(1))
    matrix = adjacency * root[:, None] * root[None, :]
    return [np.linalg.matrix_power(matrix, k).astype(np.float32) for k in range(1, HOPS + 1)]


class Graph:
    """An ONNX graph in the making."""

    def __init__(self, known: dict[str, np.ndarray]) -> None:
        self.known, self.steps, self.constants = known, [], {}

    def step(self, kind: str, inputs: list[str], output: str, **attributes: object) -> str:
        self.steps.append(helper.make_node(kind, inputs, [output], **attributes))
        return output

    def constant(self, name: str, value: np.ndarray) -> str:
        self.constants[name] = np.ascontiguousarray(value, np.float32)
        return name

    def dense(self, x: str, name: str, relu: bool) -> str:
        parts = [self.constant(f"{name}.{part}", self.known[f"{name}.{part}"]) for part in ("weight", "bias")]
        y = self.step("Gemm", [x, *parts], f"{name}.sum")
        return self.step("Relu", [y], name) if relu else y

    def encoder(self, body: str, x: str, hops: list[np.ndarray]) -> str:
        matrices = [self.constant(f"{body}.hop.{k}", power) for k, power in enumerate(hops, 1)]
        for layer in range(2):
            name = f"{body}.{layer}"
            parts = [self.step("MatMul", [hop, x], f"{name}.{hop}") for hop in matrices]
            joined = self.step("Concat", [x, *parts], f"{name}.joined", axis=1)
            x = self.dense(joined, name, relu=True)
        return x

    def session(self, inputs: dict[str, list[int]], output: str) -> onnxruntime.InferenceSession:
        def value(name: str, shape: list[int]) -> onnx.ValueInfoProto:
            return helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)

        graph = helper.make_graph(
            self.steps,
            "paper",
            [value(name, shape) for name, shape in inputs.items()],
            [value(output, [PATCH_NODES, 3])],
            [numpy_helper.from_array(number, name) for name, number in self.constants.items()],
        )
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
        onnx.checker.check_model(model)
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.execution_mode = onnxruntime.ExecutionMode.ORT_SEQUENTIAL
        options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_ENABLE_ALL
        return onnxruntime.InferenceSession(model.SerializeToString(), options, providers=["CPUExecutionProvider"])


def decoded(graph: Graph, parts: list[str]) -> str:
    """The decoder behind the patch's rows and the heads' rows (mm)."""
    x = graph.step("Concat", parts, "attended", axis=1)
    for layer in range(LAYERS):
        x = graph.dense(x, f"decoder.{layer}", relu=layer < LAYERS - 1)
    return graph.step("Mul", [x, graph.constant("unit", np.array(UNIT_MM))], "displacement_mm")


def attended(graph: Graph, head: int, query: str, across: str, rigid: str) -> str:
    scores = graph.step("MatMul", [query, across], f"scores.{head}")
    shares = graph.step("Softmax", [scores], f"shares.{head}", axis=1)
    return graph.step("MatMul", [shares, rigid], f"attended.{head}")


def whole(known: dict[str, np.ndarray], patch: list[np.ndarray], tool: list[np.ndarray]) -> onnxruntime.InferenceSession:
    """From the numbers of both bodies (`soft` 64 × 21, `tool` 102 × 25) to the displacements."""
    graph = Graph(known)
    soft, rigid = graph.encoder("soft", "soft", patch), graph.encoder("rigid", "tool", tool)
    parts = [soft]
    for head in range(HEADS):
        weight = graph.constant(f"head.{head}", known[f"head.{head}"] / math.sqrt(math.sqrt(WIDTH)))
        query, key = (graph.step("MatMul", [x, weight], f"{x}.projected.{head}") for x in (soft, rigid))
        across = graph.step("Transpose", [key], f"across.{head}", perm=[1, 0])
        parts.append(attended(graph, head, query, across, rigid))
    return graph.session({"soft": [PATCH_NODES, SOFT], "tool": [TOOL_NODES, RIGID]}, decoded(graph, parts))


def kept(
    known: dict[str, np.ndarray], soft: np.ndarray, patch: list[np.ndarray], tool: list[np.ndarray]
) -> onnxruntime.InferenceSession:
    """From the tool's numbers (`tool` 102 × 25) to the displacements of the patch with the numbers `soft`."""
    for layer in range(2):
        joined = np.concatenate([soft] + [power @ soft for power in patch], 1)
        soft = np.maximum(joined @ known[f"soft.{layer}.weight"] + known[f"soft.{layer}.bias"], 0.0)
    # The patch's rows of the decoder's first layer become its bias, one for each node.
    first = known["decoder.0.weight"]
    graph = Graph(known)
    rigid = graph.encoder("rigid", "tool", tool)
    across = graph.step("Transpose", [rigid], "across", perm=[1, 0])
    parts = []
    for head in range(HEADS):
        weight = known[f"head.{head}"]
        query = graph.constant(f"query.{head}", soft @ (weight @ weight.T / math.sqrt(WIDTH)))
        parts.append(attended(graph, head, query, across, rigid))
    graph.known = {**known, "decoder.0.weight": first[WIDTH:], "decoder.0.bias": soft @ first[:WIDTH] + known["decoder.0.bias"]}
    return graph.session({"tool": [TOOL_NODES, RIGID]}, decoded(graph, parts))
