from __future__ import annotations

import base64
import hashlib
import json
from typing import Any

import numpy as np

from bunraku.marionette import bend_table
from tests.vectors import arm


def compare(made: Any, stored: Any, where: str) -> None:
    """Assert equality, of floats to 1e-9."""
    if isinstance(made, dict):
        assert made.keys() == stored.keys(), where
        for name in made:
            if name not in ("table", "sha256"):
                compare(made[name], stored[name], f"{where}.{name}")
    elif isinstance(made, list):
        assert len(made) == len(stored), where
        for i, (one, other) in enumerate(zip(made, stored, strict=True)):
            compare(one, other, f"{where}[{i}]")
    elif isinstance(made, float):
        assert abs(made - stored) < 1e-9, where
    else:
        assert made == stored, where


def test_committed_arm_vectors_are_what_the_code_makes() -> None:
    stored = json.loads(arm.VECTORS_FILE.read_text())
    made = arm.make_vectors()
    compare(made, stored, "arm.json")
    for one, other in zip(made["arms"], stored["arms"], strict=True):
        generated, committed = (
            bend_table.parse_bend_table(base64.b64decode(vectors["table"])) for vectors in (one, other)
        )
        # one float16 step near 1: the bisection may end on the other side of a rounding border
        assert float(np.abs(generated.astype(np.float64) - committed.astype(np.float64)).max()) <= 2.0**-11


def test_committed_tables_have_the_recorded_digests() -> None:
    for vectors in json.loads(arm.VECTORS_FILE.read_text())["arms"]:
        data = base64.b64decode(vectors["table"])
        assert len(data) == bend_table.TABLE_BYTES
        assert hashlib.sha256(data).hexdigest() == vectors["sha256"]
