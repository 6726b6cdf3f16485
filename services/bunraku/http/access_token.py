"""Capability tokens: JSON Web Tokens (RFC 7519) signed with the secret of the deployment.

The only algorithm is HS256 (RFC 8725, section 3.1). Header, issuer, audience, times and the form of every claim are
verified (proto/http.md, 7.4). The module reads no clock; the time is an argument.
"""

from __future__ import annotations

import re
import secrets
from typing import Any

import jwt

from bunraku.http.access_control import Access, Role
from bunraku.runtime.display_text import clean_text

ALGORITHM = "HS256"
ISSUER = "bunraku"
"""Issuer and audience of tokens."""
MIN_SECRET_BYTES = 32
"""A key of HS256 must be at least as long as its hash (RFC 7518, section 3.2)."""
MAX_TOKEN_LENGTH = 2_048
"""Maximum number of characters of a token."""
MAX_TOKEN_LIFETIME_S = 7 * 86_400
"""Maximum time from `iat` to `exp`."""
MAX_SHARE_LIFETIME_S = 31 * 86_400
"""Maximum time from `iat` to `exp` of a token of a link, which can be revoked."""
CLOCK_SKEW_S = 60
"""Tolerance for `iat` and `nbf` of an issuer whose clock is ahead. There is none for `exp`."""
MAX_SUBJECT_CHARACTERS = 64
_REQUIRED_CLAIMS = ["iss", "aud", "exp", "iat", "jti", "sub"]
_HEADERS = ({"alg": ALGORITHM}, {"alg": ALGORITHM, "typ": "JWT"})
"""The valid headers. Others announce extensions (`crit`), other keys (`kid`, `jwk`) or nested tokens (`cty`)."""
_ID_PATTERN = re.compile(r"[A-Za-z0-9_-]{1,64}")
_MAX_JTI_CHARACTERS = 64


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

        Raises ValueError for an access without expiry, and for a token that `verify` would reject.
        """
        if access.expires is None:
            raise ValueError("a token must have an expiry time")
        claims: dict[str, Any] = {
            "iss": ISSUER,
            "aud": ISSUER,
            "iat": int(now),
            "exp": access.expires,
            "jti": access.share or secrets.token_hex(8),
            "sub": clean_text(access.subject, MAX_SUBJECT_CHARACTERS),
            "role": access.role.label,
        }
        for name in ("session", "motion", "share"):
            value = getattr(access, name)
            if value is not None:
                claims[name] = value
        token = jwt.encode(claims, self._secrets[0], ALGORITHM)
        try:
            self.verify(token, now)
        except InvalidToken as error:
            raise ValueError(f"the server would reject this token: {error.detail}") from None
        return token

    def verify(self, token: str, now: float) -> Access:
        """Return the access that a token grants at `now`, in seconds since 1970. Raises `InvalidToken`.

        The subject is returned as `clean_text` leaves it. Whether the link of a `share` exists is not checked.
        """
        claims = self._decode_claims(token)
        try:
            role = Role.parse(str(claims.get("role")))
            session, motion, share = (
                _validate_id(name, claims[name]) if name in claims else None for name in ("session", "motion", "share")
            )
        except ValueError as error:
            raise InvalidToken("invalid", str(error)) from None
        if share is not None and (role is not Role.VIEW or (session is None) == (motion is None)):
            raise InvalidToken("invalid", "a link has the role view and shows one session or one motion")
        if (session is not None or motion is not None) and role > Role.CONTROL:
            raise InvalidToken("invalid", f"the role {role.label} cannot be bound to a session or motion")
        expires = _verify_times(claims, now, MAX_TOKEN_LIFETIME_S if share is None else MAX_SHARE_LIFETIME_S)
        subject, token_id = claims["sub"], claims["jti"]
        if not isinstance(subject, str) or len(subject) > MAX_SUBJECT_CHARACTERS:
            detail = f"its subject is not a string of at most {MAX_SUBJECT_CHARACTERS} characters"
            raise InvalidToken("invalid", detail)
        if not isinstance(token_id, str) or not 0 < len(token_id) <= _MAX_JTI_CHARACTERS:
            raise InvalidToken("invalid", f"its jti is not a string of 1 to {_MAX_JTI_CHARACTERS} characters")
        return Access(role, clean_text(subject, MAX_SUBJECT_CHARACTERS), session, motion, expires, share)

    def _decode_claims(self, token: str) -> dict[str, Any]:
        """Return the claims of a token with a valid signature. Raises `InvalidToken`."""
        if len(token) > MAX_TOKEN_LENGTH:
            raise InvalidToken("invalid", f"it has more than {MAX_TOKEN_LENGTH} characters")
        for nth, secret in enumerate(self._secrets):
            try:
                decoded = jwt.decode_complete(
                    token,
                    secret,
                    algorithms=[ALGORITHM],
                    audience=ISSUER,
                    issuer=ISSUER,
                    options={
                        "require": _REQUIRED_CLAIMS,
                        "strict_aud": True,
                        # checked by `_verify_times`, with the time that the caller gives
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
            else:
                if decoded["header"] not in _HEADERS:
                    raise InvalidToken("invalid", "its header has members other than alg and typ")
                claims: dict[str, Any] = decoded["payload"]
                return claims
        raise AssertionError


def _verify_times(claims: dict[str, Any], now: float, max_lifetime_s: int) -> int:
    """Return the expiry time after checking `exp`, `iat` and `nbf` (RFC 7519, section 4.1). Raises `InvalidToken`.

    As a token is valid only from its issue on, a lifetime of at most `max_lifetime_s` also bounds the time left.
    """
    for name, label in (("exp", "expiry time"), ("iat", "time of issue"), ("nbf", "start of validity")):
        value = claims.get(name, 0)
        # True is an int
        if type(value) is not int or value < 0:
            raise InvalidToken("invalid", f"its {label} is not a number of whole seconds since 1970")
    expires: int = claims["exp"]
    if max(claims["iat"], claims.get("nbf", 0)) > now + CLOCK_SKEW_S:
        raise InvalidToken("invalid", "it is not valid yet; the clocks of issuer and server may differ")
    if expires <= now:
        raise InvalidToken("expired", "it has expired")
    if expires - claims["iat"] > max_lifetime_s:
        raise InvalidToken("invalid", f"its lifetime is more than {max_lifetime_s // 86_400} days")
    return expires


def _validate_id(name: str, value: object) -> str:
    if not isinstance(value, str) or not _ID_PATTERN.fullmatch(value):
        raise ValueError(f"the {name} in a token must be an id: {_ID_PATTERN.pattern}")
    return value
