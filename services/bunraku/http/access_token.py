"""Capability tokens: JSON Web Tokens (RFC 7519) signed with the secret of the deployment.

The only algorithm is HS256 (RFC 8725, section 3.1). Issuer and audience are verified, and the form of every claim.
The module reads no clock; the time is an argument.
"""

from __future__ import annotations

import re
import secrets
from typing import Any

import jwt

from bunraku.http.access_control import Access, Role

ALGORITHM = "HS256"
ISSUER = "bunraku"
"""Issuer and audience of tokens."""
MIN_SECRET_BYTES = 32
"""A key of HS256 must be at least as long as its hash (RFC 7518, section 3.2)."""
MAX_TOKEN_LENGTH = 2_048
"""Maximum number of characters of a token."""
_REQUIRED_CLAIMS = ["iss", "aud", "exp", "iat", "jti", "sub"]
_ID_PATTERN = re.compile(r"[A-Za-z0-9_-]{1,64}")
_MAX_SUBJECT_LENGTH = 64


class InvalidToken(Exception):
    """Rejection of a token. `reason` is `expired` or `invalid`."""

    def __init__(self, reason: str, detail: str) -> None:
        super().__init__(detail)
        self.reason, self.detail = reason, detail


class TokenSigner:
    """Signer of tokens with one secret. Also verifies tokens that were signed with a previous secret."""

    def __init__(self, secret: str, *previous_secrets: str) -> None:
        """Raise ValueError for a secret that is too short."""
        for key in (secret, *previous_secrets):
            if len(key.encode()) < MIN_SECRET_BYTES:
                raise ValueError(
                    f"the secret has {len(key.encode())} bytes, but at least {MIN_SECRET_BYTES} bytes are required"
                )
        self._secrets = (secret, *previous_secrets)

    def mint(self, access: Access, now: float) -> str:
        """Return a token that grants `access` from `now` on, in seconds since 1970.

        Raises ValueError if the access never expires, or if its role permits uploads and it is bound.
        """
        if access.expires is None:
            raise ValueError("a token must have an expiry time")
        if access.is_bound and access.role > Role.CONTROL:
            raise ValueError(f"a token with the role {access.role.label} cannot be bound to a session or motion")
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
        """Return the access that a token grants at `now`, in seconds since 1970. Raises `InvalidToken`."""
        claims = self._decode_claims(token)
        expires = claims["exp"]
        if not isinstance(expires, int) or isinstance(expires, bool):
            raise InvalidToken("invalid", "its expiry time is not a number")
        if expires <= now:
            raise InvalidToken("expired", "it has expired")
        subject = claims["sub"]
        if not isinstance(subject, str) or len(subject) > _MAX_SUBJECT_LENGTH:
            raise InvalidToken("invalid", f"its subject is not a string of at most {_MAX_SUBJECT_LENGTH} characters")
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
            raise InvalidToken("invalid", f"the role {role.label} cannot be bound to a session or motion")
        return access

    def _decode_claims(self, token: str) -> dict[str, Any]:
        """Return the claims of a token with a valid signature. Raises `InvalidToken`."""
        if len(token) > MAX_TOKEN_LENGTH:
            raise InvalidToken("invalid", f"it has more than {MAX_TOKEN_LENGTH} characters")
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
                raise InvalidToken("invalid", "it has another issuer") from None
            except jwt.InvalidAlgorithmError:
                raise InvalidToken("invalid", f"it is not signed with {ALGORITHM}") from None
            except jwt.MissingRequiredClaimError as error:
                raise InvalidToken("invalid", f"it lacks the claim {error.claim}") from None
            except (jwt.PyJWTError, ValueError, TypeError, RecursionError):
                raise InvalidToken("invalid", "it is not a JSON Web Token") from None
        raise AssertionError


def _validate_id(name: str, value: object) -> str:
    if not isinstance(value, str) or not _ID_PATTERN.fullmatch(value):
        raise ValueError(f"the {name} in a token must be an id: {_ID_PATTERN.pattern}")
    return value
