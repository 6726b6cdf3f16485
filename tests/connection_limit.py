"""Limit on the connections of an address that does not depend on the speed of the machine."""

from __future__ import annotations

import pytest

from bunraku.http import authorization

BURST_S = 10_000


def limit_connections(monkeypatch: pytest.MonkeyPatch, burst: int) -> float:
    """Return the setting `connects` that allows `burst` connections at once, and a further one only after minutes."""
    monkeypatch.setattr(authorization, "CONNECT_BURST_S", BURST_S)
    return burst / BURST_S
