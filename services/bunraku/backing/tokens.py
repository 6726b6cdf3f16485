"""Capability tokens: JSON Web Tokens (RFC 7519) signed with the deployment's secret. Reads no clock: time comes in.

The algorithm is HS256 and no other (RFC 8725, 3.1); issuer and audience are checked, and every claim's form.
"""

from __future__ import annotations

import re
import secrets
from typing import Any

import jwt

from bunraku.backing.access import Access, Role

ALGORITHM = "HS256"
NAME = "bunraku"
"""Issuer and audience."""
SHORTEST_SECRET = 32
"""Bytes: a key of HS256 is no shorter than its hash (RFC 7518, 3.2)."""
LONGEST = 2_048
"""Characters of a token."""
_REQUIRED = ["iss", "aud", "exp", "iat", "jti", "sub"]
_WORD = re.compile(r"[A-Za-z0-9_-]{1,64}")
_SUBJECT = 64


class BadToken(Exception):
    """A token that allows nothing, and why: `expired`, or `invalid` with a `detail`."""

    def __init__(self, reason: str, detail: str) -> None:
        super().__init__(detail)
        self.reason, self.detail = reason, detail


class Tokens:
    """Makes and reads the tokens of one secret, UTF-8; also reads those of the secrets `before` it."""

    def __init__(self, secret: str, *before: str) -> None:
        """Raises ValueError for a secret that is too short."""
        for one in (secret, *before):
            if len(one.encode()) < SHORTEST_SECRET:
                raise ValueError(f"a secret has at least {SHORTEST_SECRET} bytes, this has {len(one.encode())}")
        self._secrets = (secret, *before)

    def mint(self, access: Access, now: float) -> str:
        """A token that allows this from `now` on, seconds since 1970; raises ValueError where `access` never ends, or a
        role that stores is bound."""
        if access.expires is None:
            raise ValueError("a token expires")
        if access.bound and access.role > Role.CONTROL:
            raise ValueError("who stores motions is bound to none: leave out session and motion")
        claims: dict[str, Any] = {
            "iss": NAME,
            "aud": NAME,
            "iat": int(now),
            "exp": access.expires,
            "jti": access.share or secrets.token_hex(8),
            "sub": access.subject,
            "role": access.role.word,
        }
        for name in ("session", "motion", "share"):
            value = getattr(access, name)
            if value is not None:
                claims[name] = _word(name, value)
        return jwt.encode(claims, self._secrets[0], ALGORITHM)

    def read(self, token: str, now: float) -> Access:
        """What a token allows at `now`, seconds since 1970; raises `BadToken`."""
        claims = self._claims(token)
        expires = claims["exp"]
        if not isinstance(expires, int) or isinstance(expires, bool):
            raise BadToken("invalid", "its expiry is no number")
        if expires <= now:
            raise BadToken("expired", "it has expired")
        subject = claims["sub"]
        if not isinstance(subject, str) or len(subject) > _SUBJECT:
            raise BadToken("invalid", "its subject is no short text")
        try:
            role = Role.of(str(claims.get("role")))
            session, motion, share = (
                None if claims.get(name) is None else _word(name, claims[name])
                for name in ("session", "motion", "share")
            )
        except ValueError as error:
            raise BadToken("invalid", str(error)) from None
        access = Access(role, subject, session, motion, expires, share)
        if access.bound and role > Role.CONTROL:
            raise BadToken("invalid", "a role that stores is bound to nothing")
        return access

    def _claims(self, token: str) -> dict[str, Any]:
        """The claims of a token that was signed here; raises `BadToken`."""
        if len(token) > LONGEST:
            raise BadToken("invalid", f"a token has at most {LONGEST} characters")
        for nth, secret in enumerate(self._secrets):
            try:
                return jwt.decode(
                    token,
                    secret,
                    algorithms=[ALGORITHM],
                    audience=NAME,
                    issuer=NAME,
                    options={"require": _REQUIRED, "verify_exp": False, "verify_iat": False, "verify_nbf": False},
                )
            except jwt.InvalidSignatureError:
                if nth + 1 == len(self._secrets):
                    raise BadToken("invalid", "it was not signed by this server") from None
            except jwt.InvalidAudienceError:
                raise BadToken("invalid", "it is for another audience") from None
            except jwt.InvalidIssuerError:
                raise BadToken("invalid", "it is of another issuer") from None
            except jwt.InvalidAlgorithmError:
                raise BadToken("invalid", f"it is not signed with {ALGORITHM}") from None
            except jwt.MissingRequiredClaimError as error:
                raise BadToken("invalid", f"it says no {error.claim}") from None
            except (jwt.PyJWTError, ValueError, TypeError, RecursionError):
                raise BadToken("invalid", "it is no token") from None
        raise AssertionError


def _word(name: str, value: object) -> str:
    if not isinstance(value, str) or not _WORD.fullmatch(value):
        raise ValueError(f"its {name} is no id")
    return value
