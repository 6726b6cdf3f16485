"""The golden files: name -> text."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.vectors import audio, blocks, controlled_limb, messages, one_euro, scene

VECTORS_FOLDER = Path(__file__).resolve().parents[2] / "proto" / "vectors"
GENERATORS: dict[str, Callable[[], Any]] = {
    "audio.json": audio.make_vectors,
    "blocks.json": blocks.make_vectors,
    "messages.json": messages.make_vectors,
    "one_euro.json": one_euro.make_vectors,
    "pulled.json": controlled_limb.make_vectors,
    "scene.json": scene.make_vectors,
}


def render_files() -> dict[str, str]:
    """Every golden file as text, made anew; a list of numbers stands on one line."""
    lists = re.compile(r"\[[-+.\deE,\s]+\]")
    return {
        name: lists.sub(lambda found: re.sub(r"\s+", "", found[0]), json.dumps(make(), indent=1)) + "\n"
        for name, make in GENERATORS.items()
    }
