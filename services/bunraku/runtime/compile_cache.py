"""Where compiled code is kept from run to run."""

from __future__ import annotations

import os
from hashlib import sha256
from pathlib import Path

PACKAGE_FOLDER = Path(__file__).parents[1]


def compile_cache_folder(package: str) -> str | None:
    """A folder for what is compiled of a room of this package, named by all its sources; None where there is none to
    write in.

    It lies where Python keeps its own compiled code, or in `NUMBA_CACHE_DIR` where that is set.
    """
    sources = sha256()
    files = (file for file in (PACKAGE_FOLDER / package).iterdir() if file.suffix in (".py", ".json"))
    for file in sorted(files):
        sources.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    given = os.environ.get("NUMBA_CACHE_DIR")
    folder = (Path(given) / package if given else PACKAGE_FOLDER / package / "__pycache__") / sources.hexdigest()[:16]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return str(folder) if os.access(folder, os.W_OK) else None
