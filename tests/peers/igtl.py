"""Presses the retina over OpenIGTLink with pyigtl: `python igtl.py PORT`. Prints what came back as one JSON object."""

import json
import sys

import numpy as np
import pyigtl

PATIENCE_S = 20.0

client = pyigtl.OpenIGTLinkClient("127.0.0.1", int(sys.argv[1]))


def wait(device):
    message = client.wait_for_message(device, timeout=PATIENCE_S)
    if message is None:
        raise SystemExit(f"no message {device}")
    return message


def needle(tip_mm, scale=1.0):
    matrix = np.eye(4)
    matrix[0, 0] = scale
    matrix[:3, 3] = tip_mm
    client.send_message(pyigtl.TransformMessage(matrix, device_name="Needle", timestamp=12.5))


def text(message):
    client.send_message(pyigtl.StringMessage(json.dumps(message), device_name="Command"))


triangles = json.loads(wait("Session").string)["opened"]["triangles"]
text({"open": {"scene": "macula", "accuracy": {"level": "coarse"}}})
wait("Session")
text({"force_mn": [0.0, 0.125, -0.5]})
needle([0.125, -0.0625, 0.0])
answer = json.loads(wait("Answer").string)["answer"]
nodes, tip = wait("Nodes"), wait("NeedleTip")
needle([0.125, -0.0625, 0.0], scale=2.0)
problem = json.loads(wait("Problem").string)
print(
    json.dumps(
        {
            "triangles": triangles,
            "nodes_mm": nodes.positions,
            "names": nodes.names,
            "timestamp": nodes.timestamp,
            "tip_mm": tip.matrix[:3, 3].tolist(),
            "answer": answer,
            "problem": problem,
        }
    )
)
client.stop()
