"""What a job comes back with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class JobResult:
    """A motion ready to be stored: its library object, and what the API says of it."""

    packed: bytes
    description: dict[str, Any]


@dataclass(frozen=True, slots=True)
class JobRejection:
    """Why a file could not be made a motion of: the fields of `UnreadableMotion`."""

    title: str
    detail: str
    line: int | None = None
    field: str | None = None
    hint: str | None = None
