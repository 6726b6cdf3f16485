"""The secret that a server makes for itself, where it serves others and was given none."""

from __future__ import annotations

import ipaddress
import os
import secrets
from pathlib import Path

from bunraku.http.access_token import TokenSigner

SECRET_FILE_NAME = "secret"
_SECRET_BYTES = 48


def load_or_create_secret(folder: Path) -> str:
    """The secret in `folder`, made the first time, which its owner alone can read; raises ValueError where others can,
    or it is none."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / SECRET_FILE_NAME
    try:
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        pass
    else:
        with os.fdopen(file, "w") as made:
            made.write(secrets.token_urlsafe(_SECRET_BYTES))
    if path.stat().st_mode & 0o077:
        raise ValueError(f"others can read {path}: chmod 600 {path}, or remove it and a new one is made")
    secret = path.read_text().strip()
    try:
        TokenSigner(secret)
    except ValueError as error:
        raise ValueError(f"{path}: {error}; remove it and a new one is made") from None
    return secret


def load_secret(folder: Path) -> str | None:
    """As `own_secret`, None where none was made."""
    return load_or_create_secret(folder) if (folder / SECRET_FILE_NAME).exists() else None


def is_loopback(host: str) -> bool:
    """Whether this machine alone gets to what listens at `host`."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
