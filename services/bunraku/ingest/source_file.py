"""Uploaded file on the local disk."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class SourceFile:
    """An uploaded file."""

    path: Path
    filename: str
    """File name on the client's machine."""
    subject: str = ""
    """Subject that uploaded it."""
