"""What a service says when something that it stands on does not answer."""

from __future__ import annotations

ANSWERED = 1.8
"""Seconds after which the catalogue, the library or the bus counts as gone: who asked a service hears it within two."""


class Unavailable(Exception):
    """The catalogue, the library or the bus cannot be used now; `what` names which. Over HTTP it is a 503, and the same
    request may be sent again."""

    def __init__(self, what: str, why: str) -> None:
        """`why` is for the log, as it may name addresses."""
        super().__init__(f"{what} cannot be used now: {why}")
        self.what = what
