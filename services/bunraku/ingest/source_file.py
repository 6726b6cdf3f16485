"""Uploaded file on the local disk."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from bunraku.runtime.display_text import clean_text

MAX_FILENAME_CHARACTERS = 255
UNNAMED_FILE = "unnamed"
"""Name of a file whose own has no visible character."""


@dataclass(frozen=True, slots=True)
class SourceFile:
    """An uploaded file."""

    path: Path
    filename: str
    """File name on the client's machine."""
    subject: str = ""
    """Subject that uploaded it."""
    take: str | None = None
    """Motion that is meant, of those in the file."""
    is_one_of_several: bool = False
    """Whether the other motions of the file are meant too: one without movement is then rejected."""


def clean_filename(filename: str) -> str:
    """Return the name that a client gives to its file, safe to display."""
    return clean_text(filename, MAX_FILENAME_CHARACTERS) or UNNAMED_FILE
