"""Presses the retina along a circle and prints what moves: `python3 press.py [URL [TOKEN]]`."""

from __future__ import annotations

import math
import sys
import time

from retina_client import Problem, Service
from retina_client.messages import BatchPose, StepSpec

url = sys.argv[1] if len(sys.argv) > 1 else "http://127.0.0.1:8080"
service = Service(url, token=sys.argv[2] if len(sys.argv) > 2 else None)
limits = service.about()["limits"]
print(f"{limits['threads']} threads, {limits['batch_poses']} poses a batch")

answer = service.predict({"needle": {"tip_mm": [0.12, -0.05, 0.0]}, "force_mn": [0, 0, -0.4]})
print(f"{answer['accuracy']['level']}: travel {answer['needle']['travel_mm']:.4f} mm")

poses: list[BatchPose] = [{"needle": {"tip_mm": [x, 0.0, 0.0]}, "force_mn": [0, 0, -0.4]} for x in (-0.1, 0.0, 9.0)]
batch = service.predict_batch({"poses": poses, "accuracy": {"level": "linear"}})
print("batch:", ", ".join(next(iter(answer)) for answer in batch["answers"]))

steps: list[StepSpec] = [{"time_s": 0.2, "force_mn": [0, 0, -0.2]}, {"time_s": 0.4, "force_mn": [0, 0, 0]}]
lines = service.simulate({"needle": {"tip_mm": [0, 0, 0]}, "steps": steps, "effects": ["elasticity", "contact"]})
print("sequence:", ", ".join(next(iter(line)) for line in lines))

with service.stream({"needle": {"gauge": "27G"}, "accuracy": {"level": "linear"}}) as stream:
    print(f"stream: {len(stream.triangles)} triangles")
    for step in range(4):
        angle = math.tau * step / 4
        tip_mm = [0.2 * math.cos(angle), 0.2 * math.sin(angle), 0.0]
        sent = time.perf_counter()
        surface = stream.ask(tip_mm, [0.0, 0.0, -0.2], client_time_us=sent * 1e6)
        deepest = max(surface.displacement_um)
        print(f"  {surface.sequence}: {surface.contact}, travel {surface.travel_mm:.4f} mm, largest node displacement {deepest:.1f} µm")
    try:
        stream.ask([9.0, 0.0, 0.0], [0.0, 0.0, -0.2])
    except Problem as problem:
        print("refused:", problem.document["errors"][0]["field"])

rehearsal: list[StepSpec] = [{"time_s": 0.2, "tip_mm": [0.0, 0.0, -0.06]}]
with service.stream({"needle": {"gauge": "27G"}, "memory": {"rehearsal": rehearsal}}) as stream:
    stream.ask([0.0, 0.0, -0.06], time_s=0.2)
    for time_s in (1.2, 10.0):
        surface = stream.ask(None, time_s=time_s)
        print(f"held until {surface.time_s:.1f} s: {surface.reaction_mn[2]:.3f} mN")
