"""What the service says where it has no answer."""

from __future__ import annotations

from typing import cast

from .messages import ProblemDocument


class Problem(Exception):
    """What the service refused, and why: `document` is the problem document (RFC 9457)."""

    def __init__(self, document: ProblemDocument):
        super().__init__(document.get("detail", "no detail"))
        self.document = document

    @classmethod
    def of(cls, document: object) -> "Problem":
        """The problem of a document as it was read."""
        return cls(cast(ProblemDocument, document))


class StreamClosed(Exception):
    """The service has closed the stream."""
