"""Presses the retina over KServe's Open Inference Protocol with tritonclient: `python kserve.py HOST:PORT`. Prints what came back as one JSON object."""

import json
import sys

import numpy as np
import tritonclient.http as triton
from tritonclient.utils import InferenceServerException

MODEL = "retina-network"
OUTPUTS = ("vertices_mm", "normals", "travel_mm", "reaction_mn", "expected_error_um", "calibrated")

client = triton.InferenceServerClient(sys.argv[1])
assert client.is_server_live() and client.is_server_ready() and client.is_model_ready(MODEL)
metadata = client.get_model_metadata(MODEL)
assert "binary_tensor_data" in client.get_server_metadata()["extensions"]


def ask(binary, tip_mm):
    columns = {
        "tip_mm": np.array(tip_mm, dtype=np.float32),
        "force_mn": np.array([[0.0, 0.125, -0.5]] * len(tip_mm), dtype=np.float32),
        "gauge": np.array([["25G"]] * len(tip_mm), dtype=np.object_),
    }
    inputs = []
    for name, values in columns.items():
        datatype = "BYTES" if values.dtype == np.object_ else "FP32"
        tensor = triton.InferInput(name, list(values.shape), datatype)
        tensor.set_data_from_numpy(values, binary_data=binary)
        inputs.append(tensor)
    outputs = [triton.InferRequestedOutput(name, binary_data=binary) for name in OUTPUTS]
    result = client.infer(MODEL, inputs, outputs=outputs, request_id="forty-two")
    assert result.get_response()["id"] == "forty-two"
    return {name: result.as_numpy(name) for name in OUTPUTS}


tips = [[0.125, -0.0625, 0.0], [-0.25, 0.0, 0.0]]
in_binary, in_json = ask(True, tips), ask(False, tips)
for name in OUTPUTS:
    np.testing.assert_array_equal(in_binary[name], in_json[name], err_msg=name)
try:
    ask(True, [[9.0, 0.0, 0.0]])
    refused = None
except InferenceServerException as error:
    refused = error.message()
told = {name: values.tolist() for name, values in in_binary.items()}
print(json.dumps({"inputs": [tensor["name"] for tensor in metadata["inputs"]], "told": told, "refused": refused}))
