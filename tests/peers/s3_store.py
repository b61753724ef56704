"""Stored scenes in an object store: `python s3_store.py PROGRAM`, a `retina-server` that was built with `--features s3`.

Starts moto's S3 server (`pip install 'moto[server,s3]'`) and the program over it; stores, lists, uses and deletes scenes; kills the program at random moments
while it stores; and asks one that was started anew for every scene whose storing was acknowledged. Prints what was done as one JSON object.
"""

import json
import os
import random
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request

import boto3

KILLS = 8
PATIENCE_S = 60.0
BUCKET, FOLDER = "retina", "scenes"


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


def call(method, url, body=None):
    """Status and JSON of an answer; None for a connection that broke."""
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(url, data, {"content-type": "application/json"}, method=method)
    try:
        with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:
            status, text = answer.status, answer.read()
    except urllib.error.HTTPError as error:
        status, text = error.code, error.read()
    except (OSError, urllib.error.URLError):
        return None, None
    return status, json.loads(text) if text else None


def wait(what):
    began = time.monotonic()
    while not what():
        assert time.monotonic() - began < PATIENCE_S, "nothing came"
        time.sleep(0.02)


s3_port = free_port()
moto = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(s3_port)]
store = subprocess.Popen(moto, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
endpoint = f"http://127.0.0.1:{s3_port}"
keys = {"AWS_ACCESS_KEY_ID": "someone", "AWS_SECRET_ACCESS_KEY": "something", "AWS_REGION": "us-east-1"}
service = None


def serve():
    port = free_port()
    arguments = [sys.argv[1], "--listen", f"127.0.0.1:{port}", "--threads", "1", "--scene-store", f"s3://{BUCKET}/{FOLDER}"]
    variables = os.environ | keys | {"AWS_ENDPOINT_URL": endpoint, "AWS_ALLOW_HTTP": "true"}
    process = subprocess.Popen(arguments, env=variables, stderr=subprocess.DEVNULL)
    url = f"http://127.0.0.1:{port}"
    wait(lambda: process.poll() is not None or call("GET", f"{url}/readyz")[0] == 200)
    assert process.poll() is None, "the program ended"
    return process, url


def scene(number):
    """Another scene for every number, of a mesh so large that storing it takes a while."""
    side = 41
    x = [0.1 * (k - side // 2) for k in range(side)]
    vertices = [[x[k % side], x[k // side], 1e-3 * number] for k in range(side * side)]
    corners = [row * side + column for row in range(side - 1) for column in range(side - 1)]
    triangles = [t for c in corners for t in ([c, c + 1, c + side + 1], [c, c + side + 1, c + side])]
    return {"surface": {"kind": "mesh", "vertices_mm": vertices, "triangles": triangles}}


try:
    client = boto3.client(
        "s3", endpoint_url=endpoint, aws_access_key_id="someone", aws_secret_access_key="something", region_name="us-east-1"
    )

    def created():
        try:
            client.create_bucket(Bucket=BUCKET)
        except Exception:  # It is still coming up.
            return False
        return True

    wait(created)
    service, url = serve()
    status, told = call("POST", f"{url}/v1/scenes", scene(0))
    assert status == 201 and told["durable"], told
    first = told["id"]
    wait(lambda: call("GET", f"{url}/v1/scenes/{first}")[1]["state"] == "ready")
    press = call("GET", f"{url}/v1/scenes/{first}")[1]["touch"] | {"scene": first, "accuracy": {"level": "linear"}}
    status, before = call("POST", f"{url}/v1/predict", press)
    assert status == 200, before
    objects = [item["Key"] for item in client.list_objects_v2(Bucket=BUCKET)["Contents"]]
    assert objects == [f"{FOLDER}/{first}.json"], objects
    assert call("POST", f"{url}/v1/scenes", scene(0))[0] == 200, "it is stored already"

    acknowledged, broken, number = [first], 0, 1
    for kill in range(KILLS):
        random.seed(kill)
        timer = threading.Timer(random.uniform(0.05, 0.8), service.kill)
        timer.start()
        while True:
            status, told = call("POST", f"{url}/v1/scenes", scene(number))
            number += 1
            if status != 201:
                assert status is None, told
                broken += 1
                break
            acknowledged.append(told["id"])
        timer.join()
        service.wait()
        service, url = serve()
    states = {told["id"]: told["state"] for told in call("GET", f"{url}/v1/scenes")[1]["stored"]}
    missing = [id for id in acknowledged if id not in states]
    assert not missing, missing
    unacknowledged = [id for id in states if id not in acknowledged]
    assert len(unacknowledged) <= broken, unacknowledged
    for id in states:
        wait(lambda: call("GET", f"{url}/v1/scenes/{id}")[1]["state"] != "preparing")
        told = call("GET", f"{url}/v1/scenes/{id}")[1]
        assert told["state"] == "ready", told
    status, after = call("POST", f"{url}/v1/predict", press)
    assert status == 200 and after["surface"] == before["surface"], "another answer after the kills"

    for id in states:
        assert call("DELETE", f"{url}/v1/scenes/{id}")[0] == 204
    assert call("DELETE", f"{url}/v1/scenes/{first}")[0] == 404
    assert "Contents" not in client.list_objects_v2(Bucket=BUCKET)

    # Without its store the service says so, and goes on.
    store.kill()
    store.wait()
    status, problem = call("POST", f"{url}/v1/scenes", scene(number))
    assert status == 503, problem
    del press["scene"]
    assert call("POST", f"{url}/v1/predict", press)[0] == 200
    done = {"acknowledged": len(acknowledged), "kills": KILLS, "broken": broken, "whole though not acknowledged": len(unacknowledged)}
    print(json.dumps(done))
finally:
    for process in (service, store):
        if process is not None:
            process.kill()
