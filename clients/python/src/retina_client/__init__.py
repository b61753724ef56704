"""A client of the retina service: Python 3.9 or newer, the standard library alone.

    service = Service("http://127.0.0.1:8080")
    answer = service.predict({"needle": {"tip_mm": [0.12, -0.05, 0.0]}, "force_mn": [0, 0, -0.4]})

    with service.stream({"accuracy": {"level": "linear"}}) as stream:
        surface = stream.ask(tip_mm=[0.12, -0.05, 0.0], force_mn=[0, 0, -0.4])

Units are mm, mN and kPa, errors in µm; +z points out of the tissue. What the service refuses is raised as `Problem`. The types of all
messages are in `retina_client.messages`.
"""

from ._binary import Surface
from ._problem import Problem, StreamClosed
from ._service import Service
from ._stream import Stream

__all__ = ["Problem", "Service", "Stream", "StreamClosed", "Surface"]

# Where people find them, in a traceback too.
for _public in (Problem, StreamClosed, Service, Stream, Surface):
    _public.__module__ = __name__
