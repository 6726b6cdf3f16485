"""Those who come to a server with a secret: what they hold, good and bad."""

from __future__ import annotations

import base64
import json
import time
from typing import Any

import jwt

from bunraku.http.access_control import Access, Role
from bunraku.http.access_token import ISSUER, TokenSigner

SECRET = "a secret for tests, long enough for every algorithm that they try: 64 bytes and some"
OTHER_SECRET = f"not {SECRET}"


def make_token(
    role: Role = Role.ADMIN,
    subject: str = "guest",
    lifetime_s: int = 600,
    session: str | None = None,
    motion: str | None = None,
) -> str:
    """A good token."""
    now = int(time.time())
    return TokenSigner(SECRET).mint(Access(role, subject, session, motion, now + lifetime_s), now)


def make_claims(**overrides: Any) -> dict[str, Any]:
    """Those of a good token for an admin, but for some."""
    now = int(time.time())
    good = {"iss": ISSUER, "aud": ISSUER, "iat": now, "exp": now + 600, "jti": "j", "sub": "guest", "role": "admin"}
    return {name: value for name, value in {**good, **overrides}.items() if value is not None}


def sign_token(secret: str = SECRET, algorithm: str = "HS256", **other: Any) -> str:
    """A token with other claims, another secret or another algorithm."""
    return jwt.encode(make_claims(**other), secret, algorithm)


def make_unsigned_token() -> str:
    """A token of `alg: none`."""

    def part(value: dict[str, Any]) -> str:
        return base64.urlsafe_b64encode(json.dumps(value).encode()).rstrip(b"=").decode()

    return f"{part({'alg': 'none', 'typ': 'JWT'})}.{part(make_claims())}."


def bearer_headers(bearer_token: str | None) -> dict[str, str]:
    """Those of a request with a token."""
    return {} if bearer_token is None else {"Authorization": f"Bearer {bearer_token}"}
