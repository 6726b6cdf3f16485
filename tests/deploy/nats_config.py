"""Configuration files of nats-server from the stack, adapted to servers on this machine."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path

from tests.certificates import Authority
from tests.processes import find_program, free_port


def create_certificates(folder: Path) -> None:
    """Create the authority `ca.crt` and the certificate `tls.crt` that servers on this machine present."""
    folder.mkdir()
    Authority(folder, "ca").issue("tls", "localhost", "127.0.0.1")


def localize_config(file: Path, folder: Path, replacements: Mapping[str, str]) -> Path:
    """Copy a configuration file and its includes to `folder` with paths and addresses replaced; return the copy.

    Raises AssertionError if a text to replace does not occur. For nats-server before 2.10, which does not know it,
    `sync_interval` is removed.
    """
    for included in re.findall(r"^include (\S+)$", file.read_text(), re.MULTILINE):
        shutil.copy(file.parent / included, folder)
    copy = folder / file.name
    shutil.copy(file, copy)
    version_text = subprocess.check_output([find_program("nats-server"), "--version"], text=True)
    version = re.search(r"v(\d+)\.(\d+)", version_text)
    assert version is not None, version_text
    old = (int(version[1]), int(version[2])) < (2, 10)
    found = set()
    for path in folder.glob("*.conf"):
        text = path.read_text()
        for original, replacement in {"127.0.0.1:8222": f"127.0.0.1:{free_port()}", **replacements}.items():
            found |= {original} if original in text else set()
            text = text.replace(original, replacement)
        path.write_text(re.sub(r"^\s*sync_interval: .*\n", "", text, flags=re.MULTILINE) if old else text)
    assert set(replacements) <= found, set(replacements) - found
    return copy
