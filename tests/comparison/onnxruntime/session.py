"""Evaluates the paper's network in ONNX Runtime when told to: `python session.py FOLDER`, started by `retina-models runtime`.

FOLDER holds `weights.safetensors`, the edges of both meshes (`patch.u32`, `tool.u32`: pairs), the patch's numbers (`soft.f32`) and those of the tool for each sample
(`rigid.f32`). A line `answer KIND` writes all displacements (mm) to `KIND.f32`; a line `time KIND` evaluates every sample once and prints the
seconds of each. KIND is `whole` or `kept`. Times are of the evaluation alone, by this program's own clock: what passes between the two programs is not in them.
"""

from __future__ import annotations

import pathlib
import sys
import time

import numpy as np

import network

folder = pathlib.Path(sys.argv[1])
known = network.weights(str(folder / "weights.safetensors"))
patch, tool = (
    network.powers(nodes, np.fromfile(folder / f"{name}.u32", "<u4").reshape(-1, 2).astype(int))
    for name, nodes in (("patch", network.PATCH_NODES), ("tool", network.TOOL_NODES))
)
soft = np.fromfile(folder / "soft.f32", "<f4").reshape(network.PATCH_NODES, network.SOFT)
samples = np.fromfile(folder / "rigid.f32", "<f4").reshape(-1, network.TOOL_NODES, network.RIGID)
sessions = {
    "whole": (network.whole(known, patch, tool), lambda sample: {"soft": soft, "tool": sample}),
    "kept": (network.kept(known, soft, patch, tool), lambda sample: {"tool": sample}),
}
print("ready", flush=True)
for line in sys.stdin:
    what, kind = line.split()
    session, inputs = sessions[kind]
    if what == "answer":
        answers = [session.run(None, inputs(sample))[0] for sample in samples]
        np.concatenate(answers).astype("<f4").tofile(folder / f"{kind}.f32")
        print("done", flush=True)
        continue
    seconds = []
    for sample in samples:
        given = inputs(sample)
        start = time.perf_counter()
        session.run(None, given)
        seconds.append(time.perf_counter() - start)
    print(" ".join(f"{second:.9f}" for second in seconds), flush=True)
