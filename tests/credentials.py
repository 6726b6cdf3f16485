"""Valid and invalid tokens for servers with a secret."""

from __future__ import annotations

import base64
import json
import time
from typing import Any

import jwt

from bunraku.http.access_control import Access, Role
from bunraku.http.access_token import ISSUER, TokenSigner

SECRET = "a secret for tests, long enough for every tested algorithm: more than 64 bytes"
OTHER_SECRET = f"not {SECRET}"


def make_token(
    role: Role = Role.ADMIN,
    subject: str = "guest",
    lifetime_s: int = 600,
    session: str | None = None,
    motion: str | None = None,
) -> str:
    """Return a token that is valid if `lifetime_s`, in seconds from now, is positive."""
    now = int(time.time())
    # a token must be valid when it is signed
    issued = min(now, now + lifetime_s - 1)
    return TokenSigner(SECRET).mint(Access(role, subject, session, motion, now + lifetime_s), issued)


def make_claims(**overrides: Any) -> dict[str, Any]:
    """Return the claims of a valid admin token with overrides. A claim of None is omitted."""
    now = int(time.time())
    claims = {"iss": ISSUER, "aud": ISSUER, "iat": now, "exp": now + 600, "jti": "j", "sub": "guest", "role": "admin"}
    return {name: value for name, value in {**claims, **overrides}.items() if value is not None}


def sign_token(secret: str = SECRET, algorithm: str = "HS256", **overrides: Any) -> str:
    """Return a signed token with overridden claims."""
    return jwt.encode(make_claims(**overrides), secret, algorithm)


def sign_nested_token() -> str:
    """Return a signed token whose payload is a token (RFC 7519, section 2, Nested JWT)."""
    return jwt.api_jws.encode(sign_token().encode(), SECRET, "HS256", headers={"cty": "JWT"})


def make_unsigned_token() -> str:
    """Return a token with `alg: none`."""

    def encode(value: dict[str, Any]) -> str:
        return base64.urlsafe_b64encode(json.dumps(value).encode()).rstrip(b"=").decode()

    return f"{encode({'alg': 'none', 'typ': 'JWT'})}.{encode(make_claims())}."


def bearer_headers(bearer_token: str | None) -> dict[str, str]:
    """Return the headers of a request with a token."""
    return {} if bearer_token is None else {"Authorization": f"Bearer {bearer_token}"}
