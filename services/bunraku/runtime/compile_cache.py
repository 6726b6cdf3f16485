"""Folder for compiled kernels, reused between runs."""

from __future__ import annotations

import os
from hashlib import sha256
from pathlib import Path

PACKAGE_FOLDER = Path(__file__).parents[1]


def compile_cache_folder(package: str) -> str | None:
    """Return the folder for compiled code of a subpackage, None if none is writable.

    Its name is a hash of all sources of the subpackage. It lies in `__pycache__`, or in `NUMBA_CACHE_DIR` if that is
    set.
    """
    sources = sha256()
    root = PACKAGE_FOLDER / package
    for file in sorted(file for file in root.rglob("*") if file.suffix in (".py", ".json")):
        sources.update(str(file.relative_to(root)).encode() + b"\0" + file.read_bytes() + b"\0")
    configured = os.environ.get("NUMBA_CACHE_DIR")
    parent = Path(configured) / package if configured else PACKAGE_FOLDER / package / "__pycache__"
    folder = parent / sources.hexdigest()[:16]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return str(folder) if os.access(folder, os.W_OK) else None
