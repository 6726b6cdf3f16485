"""Capability tokens: JSON Web Tokens (RFC 7519) signed with the deployment's secret. Reads no clock: time comes in.

The algorithm is HS256 and no other (RFC 8725, 3.1); issuer and audience are checked, and every claim's form.
"""

from __future__ import annotations

import re
import secrets
from typing import Any

import jwt

from bunraku.http.access_control import Access, Role

ALGORITHM = "HS256"
ISSUER = "bunraku"
"""Issuer and audience."""
MIN_SECRET_BYTES = 32
"""Bytes: a key of HS256 is no shorter than its hash (RFC 7518, 3.2)."""
MAX_TOKEN_LENGTH = 2_048
"""Characters of a token."""
_REQUIRED_CLAIMS = ["iss", "aud", "exp", "iat", "jti", "sub"]
_ID_PATTERN = re.compile(r"[A-Za-z0-9_-]{1,64}")
_MAX_SUBJECT_LENGTH = 64


class InvalidToken(Exception):
    """A token that allows nothing, and why: `expired`, or `invalid` with a `detail`."""

    def __init__(self, reason: str, detail: str) -> None:
        super().__init__(detail)
        self.reason, self.detail = reason, detail


class TokenSigner:
    """Makes and reads the tokens of one secret, UTF-8; also reads those of the secrets `before` it."""

    def __init__(self, secret: str, *previous_secrets: str) -> None:
        """Raises ValueError for a secret that is too short."""
        for one in (secret, *previous_secrets):
            if len(one.encode()) < MIN_SECRET_BYTES:
                raise ValueError(f"a secret has at least {MIN_SECRET_BYTES} bytes, this has {len(one.encode())}")
        self._secrets = (secret, *previous_secrets)

    def mint(self, access: Access, now: float) -> str:
        """A token that allows this from `now` on, seconds since 1970; raises ValueError where `access` never ends, or a
        role that stores is bound."""
        if access.expires is None:
            raise ValueError("a token expires")
        if access.is_bound and access.role > Role.CONTROL:
            raise ValueError("who stores motions is bound to none: leave out session and motion")
        claims: dict[str, Any] = {
            "iss": ISSUER,
            "aud": ISSUER,
            "iat": int(now),
            "exp": access.expires,
            "jti": access.share or secrets.token_hex(8),
            "sub": access.subject,
            "role": access.role.label,
        }
        for name in ("session", "motion", "share"):
            value = getattr(access, name)
            if value is not None:
                claims[name] = _validate_id(name, value)
        return jwt.encode(claims, self._secrets[0], ALGORITHM)

    def verify(self, token: str, now: float) -> Access:
        """What a token allows at `now`, seconds since 1970; raises `BadToken`."""
        claims = self._decode_claims(token)
        expires = claims["exp"]
        if not isinstance(expires, int) or isinstance(expires, bool):
            raise InvalidToken("invalid", "its expiry is no number")
        if expires <= now:
            raise InvalidToken("expired", "it has expired")
        subject = claims["sub"]
        if not isinstance(subject, str) or len(subject) > _MAX_SUBJECT_LENGTH:
            raise InvalidToken("invalid", "its subject is no short text")
        try:
            role = Role.parse(str(claims.get("role")))
            session, motion, share = (
                None if claims.get(name) is None else _validate_id(name, claims[name])
                for name in ("session", "motion", "share")
            )
        except ValueError as error:
            raise InvalidToken("invalid", str(error)) from None
        access = Access(role, subject, session, motion, expires, share)
        if access.is_bound and role > Role.CONTROL:
            raise InvalidToken("invalid", "a role that stores is bound to nothing")
        return access

    def _decode_claims(self, token: str) -> dict[str, Any]:
        """The claims of a token that was signed here; raises `BadToken`."""
        if len(token) > MAX_TOKEN_LENGTH:
            raise InvalidToken("invalid", f"a token has at most {MAX_TOKEN_LENGTH} characters")
        for nth, secret in enumerate(self._secrets):
            try:
                return jwt.decode(
                    token,
                    secret,
                    algorithms=[ALGORITHM],
                    audience=ISSUER,
                    issuer=ISSUER,
                    options={
                        "require": _REQUIRED_CLAIMS,
                        "verify_exp": False,
                        "verify_iat": False,
                        "verify_nbf": False,
                    },
                )
            except jwt.InvalidSignatureError:
                if nth + 1 == len(self._secrets):
                    raise InvalidToken("invalid", "it was not signed by this server") from None
            except jwt.InvalidAudienceError:
                raise InvalidToken("invalid", "it is for another audience") from None
            except jwt.InvalidIssuerError:
                raise InvalidToken("invalid", "it is of another issuer") from None
            except jwt.InvalidAlgorithmError:
                raise InvalidToken("invalid", f"it is not signed with {ALGORITHM}") from None
            except jwt.MissingRequiredClaimError as error:
                raise InvalidToken("invalid", f"it says no {error.claim}") from None
            except (jwt.PyJWTError, ValueError, TypeError, RecursionError):
                raise InvalidToken("invalid", "it is no token") from None
        raise AssertionError


def _validate_id(name: str, value: object) -> str:
    if not isinstance(value, str) or not _ID_PATTERN.fullmatch(value):
        raise ValueError(f"its {name} is no id")
    return value
