"""The secret that a server makes for itself, where it serves others and was given none."""

from __future__ import annotations

import ipaddress
import os
import secrets
from pathlib import Path

from bunraku.backing.tokens import Tokens

NAME = "secret"
_BYTES = 48


def own_secret(folder: Path) -> str:
    """The secret in `folder`, made the first time, which its owner alone can read; raises ValueError where others can,
    or it is none."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / NAME
    try:
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        pass
    else:
        with os.fdopen(file, "w") as made:
            made.write(secrets.token_urlsafe(_BYTES))
    if path.stat().st_mode & 0o077:
        raise ValueError(f"others can read {path}: chmod 600 {path}, or remove it and a new one is made")
    secret = path.read_text().strip()
    try:
        Tokens(secret)
    except ValueError as error:
        raise ValueError(f"{path}: {error}; remove it and a new one is made") from None
    return secret


def kept_secret(folder: Path) -> str | None:
    """As `own_secret`, None where none was made."""
    return own_secret(folder) if (folder / NAME).exists() else None


def is_loopback(host: str) -> bool:
    """Whether this machine alone gets to what listens at `host`."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
