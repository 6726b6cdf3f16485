"""Secret that a server creates for itself if it is reachable by others and has none."""

from __future__ import annotations

import ipaddress
import os
import secrets
from pathlib import Path

from bunraku.http.access_token import TokenSigner

SECRET_FILE_NAME = "secret"
_SECRET_BYTES = 48


def load_or_create_secret(folder: Path) -> str:
    """Return the secret in `folder`, created at the first call and readable only by its owner.

    Raises ValueError if others can read the file, or if its content is not a valid secret.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / SECRET_FILE_NAME
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        pass
    else:
        with os.fdopen(descriptor, "w") as file:
            file.write(secrets.token_urlsafe(_SECRET_BYTES))
    if path.stat().st_mode & 0o077:
        raise ValueError(f"other users can read {path}: run chmod 600 {path}, or delete it to create a new secret")
    secret = path.read_text().strip()
    try:
        TokenSigner(secret)
    except ValueError as error:
        raise ValueError(f"{path}: {error}; delete it to create a new secret") from None
    return secret


def load_secret(folder: Path) -> str | None:
    """Return the secret in `folder`, None if there is none. Raises ValueError as `load_or_create_secret` does."""
    return load_or_create_secret(folder) if (folder / SECRET_FILE_NAME).exists() else None


def is_loopback(host: str) -> bool:
    """Return whether a server that listens at `host` is reachable only from this machine."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
