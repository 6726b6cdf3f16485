"""Those who come to a server with a secret: what they hold, good and bad."""

from __future__ import annotations

import base64
import json
import time
from typing import Any

import jwt

from bunraku.backing.access import Access, Role
from bunraku.backing.tokens import NAME, Tokens

SECRET = "a secret for tests, long enough for every algorithm that they try: 64 bytes and some"
OTHER = f"not {SECRET}"


def token(
    role: Role = Role.ADMIN,
    subject: str = "guest",
    seconds: int = 600,
    session: str | None = None,
    motion: str | None = None,
) -> str:
    """A good token."""
    now = int(time.time())
    return Tokens(SECRET).mint(Access(role, subject, session, motion, now + seconds), now)


def claims(**other: Any) -> dict[str, Any]:
    """Those of a good token for an admin, but for some."""
    now = int(time.time())
    good = {"iss": NAME, "aud": NAME, "iat": now, "exp": now + 600, "jti": "j", "sub": "guest", "role": "admin"}
    return {name: value for name, value in {**good, **other}.items() if value is not None}


def signed(secret: str = SECRET, algorithm: str = "HS256", **other: Any) -> str:
    """A token with other claims, another secret or another algorithm."""
    return jwt.encode(claims(**other), secret, algorithm)


def unsigned() -> str:
    """A token of `alg: none`."""

    def part(value: dict[str, Any]) -> str:
        return base64.urlsafe_b64encode(json.dumps(value).encode()).rstrip(b"=").decode()

    return f"{part({'alg': 'none', 'typ': 'JWT'})}.{part(claims())}."


def headers(held: str | None) -> dict[str, str]:
    """Those of a request with a token."""
    return {} if held is None else {"Authorization": f"Bearer {held}"}
