"""The stack's own files of nats-server, for servers of this machine."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path

from tests.processes import find_program, free_port


def localize_config(file: Path, folder: Path, replacements: Mapping[str, str]) -> Path:
    """A copy in `folder` with other places, each of which must be named in it: its ports are taken, its folders root's.
    What a nats-server before 2.10 does not know is left out for it; a file that is included comes along."""
    for included in re.findall(r"^include (\S+)$", file.read_text(), re.MULTILINE):
        shutil.copy(file.parent / included, folder)
    copy = folder / file.name
    shutil.copy(file, copy)
    said = subprocess.check_output([find_program("nats-server"), "--version"], text=True)
    version = re.search(r"v(\d+)\.(\d+)", said)
    assert version is not None, said
    old = (int(version[1]), int(version[2])) < (2, 10)
    found = set()
    for path in folder.glob("*.conf"):
        text = path.read_text()
        for here, there in {"127.0.0.1:8222": f"127.0.0.1:{free_port()}", **replacements}.items():
            found |= {here} if here in text else set()
            text = text.replace(here, there)
        path.write_text(re.sub(r"^\s*sync_interval: .*\n", "", text, flags=re.MULTILINE) if old else text)
    assert set(replacements) <= found, set(replacements) - found
    return copy
