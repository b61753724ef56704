"""Files to begin a search with, in tests/fuzz/corpus/TARGET."""

import hashlib
import json
import pathlib
import struct

CORPUS = pathlib.Path(__file__).parent / "corpus"


def seed(target, name, content):
    folder = CORPUS / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(content)


PLY_HEAD = "ply\nformat {} 1.0\nelement vertex 4\nproperty double x\nproperty float y\nproperty double z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
PLY = PLY_HEAD.format("ascii") + "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n"
VERTICES = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
PLY_BINARY = PLY_HEAD.format("binary_little_endian").encode()
PLY_BINARY += b"".join(struct.pack("<dfd", *vertex) for vertex in VERTICES)
PLY_BINARY += b"".join(struct.pack("<B3i", 3, *face) for face in [(0, 1, 2), (0, 2, 3)])
OBJ = "# a square\nv 0 0 0\nv 1 0 0 1\nv 1 1 0 0.5 0.5 0.5\nv 0 1 1e-3\nvt 0 0\nvn 0 0 1\nf 1/1/1 2//1 3 -1\n"
STL = "solid a\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 1 1 0\n  endloop\n endfacet\nendsolid a\n"
STL_BINARY = b"solid".ljust(80) + struct.pack("<I12fH", 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 1, 0, 0)
for name, number, content in [("ply", 0, PLY.encode()), ("ply_binary", 0, PLY_BINARY), ("obj", 1, OBJ.encode()), ("stl", 2, STL.encode()), ("stl_binary", 2, STL_BINARY)]:
    seed("mesh", name, bytes([number]) + content)

NEEDLE = {"tip_mm": [0.1, -0.05, 0.0], "direction": [0, 0, -1], "gauge": "25G", "tip": {"bevelled": {"angle_deg": 30.0}}}
SCENE = {"surface": {"kind": "foveal_pit", "depth_mm": 0.1}, "tissue": {"retina": [{"thickness_mm": 0.1}, {}], "bond": {"strength_kpa": 10}, "rate": {"retina_relaxation": []}},
         "pose": {"position_mm": [0, 0, 1], "orientation_xyzw": [0, 0, 0, 1]}, "friction_coefficient": 0.1, "puncture": {"max_force_mn": 2}}
MESH = {"surface": {"kind": "mesh", "vertices_mm": VERTICES, "triangles": [[0, 1, 2], [0, 2, 3]]}}
ACCURACY = {"level": "linear", "max_error_um": 5, "max_time_ms": 2, "strict": True}
PREDICT = {"scene": SCENE, "needle": NEEDLE, "force_mn": [0, 0.1, -0.8], "accuracy": ACCURACY, "effects": ["contact"], "control": "force"}
BATCH = {"scene": "fovea", "poses": [{"needle": NEEDLE, "force_mn": [0, 0, -0.1]}, {"needle": NEEDLE, "control": "pose"}], "accuracy": ACCURACY, "effects": "all"}
SIMULATE = {"needle": NEEDLE, "steps": [{"time_s": 0.2, "force_mn": [0, 0, -0.4]}, {"time_s": 1.2, "tip_mm": [0, 0, 0]}], "effects": "auto"}
for number, message in enumerate([PREDICT, BATCH, SIMULATE]):
    seed("request", f"request_{number}", bytes([number]) + json.dumps(message).encode())
for number, scene in enumerate([{}, SCENE, MESH, {"surface": {"kind": "mesh", "obj": OBJ}}, {"surface": {"kind": "mesh", "stl": STL}}]):
    seed("scene", f"scene_{number}", json.dumps(scene).encode())

seed("stream", "pose", b"RTNA" + struct.pack("<BBHQd10f", 1, 1, 1, 1, 0.0, 0, 0, 0, 0, 0, 0, 1, 0, 0, -0.1))
seed("stream", "open", json.dumps({"open": {"scene": "macula", "needle": {"gauge": "25G"}, "accuracy": {"level": "linear"}, "format": "binary"}}).encode())
seed("stream", "text", json.dumps({"pose": {"sequence": 1, "client_time_us": 1.5, "tip_mm": [0, 0, 0], "force_mn": [0, 0, -0.1]}}).encode())

DATA = struct.pack("<6f", *range(6))
for network in ["contact", "corrected", "faithful"]:
    header = {"__metadata__": {"sha256": hashlib.sha256(DATA).hexdigest(), "network": network}, "a": {"dtype": "F32", "shape": [2, 3], "data_offsets": [0, 24]}}
    text = json.dumps(header, separators=(",", ":")).encode()
    seed("weights", network, struct.pack("<Q", len(text)) + text + DATA)
