"""The golden files: name -> text."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.vectors import audio, blocks, messages, one_euro, pulled, scene

FOLDER = Path(__file__).resolve().parents[2] / "proto" / "vectors"
MAKERS: dict[str, Callable[[], Any]] = {
    "audio.json": audio.make,
    "blocks.json": blocks.make,
    "messages.json": messages.make,
    "one_euro.json": one_euro.make,
    "pulled.json": pulled.make,
    "scene.json": scene.make,
}


def files() -> dict[str, str]:
    """Every golden file as text, made anew; a list of numbers stands on one line."""
    lists = re.compile(r"\[[-+.\deE,\s]+\]")
    return {
        name: lists.sub(lambda found: re.sub(r"\s+", "", found[0]), json.dumps(make(), indent=1)) + "\n"
        for name, make in MAKERS.items()
    }
