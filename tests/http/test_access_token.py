from __future__ import annotations

import dataclasses
import string
from typing import Any

import jwt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.http.access_control import Access, Role
from bunraku.http.access_token import (
    CLOCK_SKEW_S,
    MAX_SHARE_LIFETIME_S,
    MAX_TOKEN_LENGTH,
    MAX_TOKEN_LIFETIME_S,
    InvalidToken,
    TokenSigner,
)
from bunraku.runtime.display_text import clean_text
from tests.credentials import (
    OTHER_SECRET,
    SECRET,
    make_claims,
    make_unsigned_token,
    sign_nested_token,
    sign_token,
)

NOW = 1_800_000_000
IDS = st.text(string.ascii_letters + string.digits + "_-", min_size=1, max_size=64)
SIGNER = TokenSigner(SECRET)


def sign(secret: str = SECRET, algorithm: str = "HS256", **overrides: Any) -> str:
    """Return a token of the time `NOW` with overridden claims: it may be made long before the test runs."""
    return sign_token(secret, algorithm, **{"iat": NOW, "exp": NOW + 600, **overrides})


@given(
    role=st.sampled_from(Role),
    subject=st.text(max_size=64),
    session=st.none() | IDS,
    motion=st.none() | IDS,
    share=st.none() | IDS,
    seconds=st.integers(1, 2 * MAX_SHARE_LIFETIME_S),
)
def test_minted_token_verifies_until_it_expires(
    role: Role, subject: str, session: str | None, motion: str | None, share: str | None, seconds: int
) -> None:
    access = Access(role, subject, session, motion, NOW + seconds, share)
    is_link = role is Role.VIEW and (session is None) != (motion is None)
    max_lifetime_s = MAX_TOKEN_LIFETIME_S if share is None else MAX_SHARE_LIFETIME_S
    is_permitted = (is_link if share is not None else not access.is_bound or role <= Role.CONTROL) and (
        seconds <= max_lifetime_s
    )
    if not is_permitted:
        with pytest.raises(ValueError, match="the server would reject this token"):
            SIGNER.mint(access, NOW)
        return
    token = SIGNER.mint(access, NOW)
    expected = dataclasses.replace(access, subject=clean_text(subject, 64))
    assert SIGNER.verify(token, NOW) == SIGNER.verify(token, NOW + seconds - 1) == expected
    with pytest.raises(InvalidToken) as bad:
        SIGNER.verify(token, NOW + seconds)
    assert bad.value.reason == "expired"


@pytest.mark.parametrize(
    ("token", "detail"),
    [
        (sign(OTHER_SECRET), "not signed by this server"),
        (sign(aud="other"), "another audience"),
        (sign(aud=None), "lacks the claim aud"),
        (sign(iss="other"), "another issuer"),
        (sign(exp=None), "lacks the claim exp"),
        (sign(jti=None), "lacks the claim jti"),
        (sign(sub=None), "lacks the claim sub"),
        (sign(iat=None), "lacks the claim iat"),
        (sign(exp=True), "expiry time is not a number"),
        (sign(exp="9999999999"), "not a "),
        (sign(exp=float("inf")), "not a "),
        (sign(exp=float("nan")), "not a "),
        (sign(exp=4e9), "not a "),
        (sign(exp=[4_000_000_000]), "not a "),
        (sign(exp=10**40), "lifetime is more than 7 days"),
        (sign(exp=4_000_000_000), "lifetime is more than 7 days"),
        (sign(exp=-5), "expiry time is not a number"),
        (sign(iat=-1), "time of issue is not a number"),
        (sign(iat=True), "time of issue is not a number"),
        (sign(iat="now"), "not a "),
        (sign(iat=0), "lifetime is more than 7 days"),
        (sign(iat=10**40), "not valid yet"),
        (sign(nbf=4_000_000_000), "not valid yet"),
        (sign(nbf=False), "start of validity is not a number"),
        (sign(nbf=1.5), "start of validity is not a number"),
        (sign(nbf="1"), "not a "),
        (sign(share="s1"), "a link has the role view"),
        (sign(share="s1", role="control", session="s"), "a link has the role view"),
        (sign(share="s1", role="view"), "a link has the role view"),
        (sign(share="s1", role="view", session="s", motion="m"), "a link has the role view"),
        (sign(share=True, role="view", session="s"), "share in a token must be an id"),
        (sign(role=True), "unknown role"),
        (sign(role="view", session=""), "session in a token must be an id"),
        (sign(role="view", session=False), "session in a token must be an id"),
        (sign(sub=5), "not a "),
        (sign(jti=5), "not a "),
        (sign(jti=""), "jti"),
        (sign(jti="x" * 65), "jti"),
        (sign(aud=["bunraku", "other"]), "another audience"),
        (sign_nested_token(), "not a JSON Web Token"),
        (sign(role="owner"), "unknown role"),
        (sign(role=["admin"]), "unknown role"),
        (sign(role="view", session="a.b"), "session in a token must be an id"),
        (sign(role="view", motion=5), "motion in a token must be an id"),
        (sign(role="admin", motion="m"), "cannot be bound"),
        (sign(sub="x" * 65), "subject"),
        (sign(algorithm="HS384"), "not signed with HS256"),
        (sign(algorithm="HS512"), "not signed with HS256"),
        (make_unsigned_token(), "not signed with HS256"),
        ("", "not a JSON Web Token"),
        ("a.b.c", "not a JSON Web Token"),
        ("x" * (MAX_TOKEN_LENGTH + 1), "characters"),
    ],
)
def test_invalid_token_is_rejected_with_a_reason(token: str, detail: str) -> None:
    with pytest.raises(InvalidToken, match=detail) as bad:
        SIGNER.verify(token, NOW)
    assert bad.value.reason == "invalid"


@pytest.mark.parametrize(
    "header",
    [
        {"crit": ["exp"]},
        {"crit": ["b64"], "b64": True},
        {"kid": "1"},
        {"typ": "at+jwt"},
        {"typ": None},
        {"cty": "JWT"},
        {"jku": "https://evil.example/keys"},
        {"zip": "DEF"},
    ],
)
def test_token_with_an_extended_header_is_rejected(header: dict[str, Any]) -> None:
    # PyJWT omits typ if it is None
    claims = make_claims()
    token = jwt.encode(claims, SECRET, "HS256", headers=header)
    if header == {"typ": None}:
        assert SIGNER.verify(token, claims["iat"]).role is Role.ADMIN
        return
    with pytest.raises(InvalidToken):
        SIGNER.verify(token, claims["iat"])


def test_times_of_issue_and_validity_may_be_ahead_by_the_clock_skew() -> None:
    claims = make_claims(iat=NOW, nbf=NOW + 10, exp=NOW + MAX_TOKEN_LIFETIME_S)
    token = jwt.encode(claims, SECRET, "HS256")
    assert SIGNER.verify(token, NOW + 10 - CLOCK_SKEW_S).subject == "guest"
    with pytest.raises(InvalidToken, match="not valid yet"):
        SIGNER.verify(token, NOW + 9 - CLOCK_SKEW_S)
    # the time left never exceeds the maximum by more than the skew
    with pytest.raises(InvalidToken, match="lifetime"):
        SIGNER.verify(jwt.encode({**claims, "exp": claims["exp"] + 1}, SECRET, "HS256"), NOW + 10)


def test_only_a_link_may_last_longer_than_a_week() -> None:
    link = Access(Role.VIEW, "share s1", session="s", expires=NOW + MAX_SHARE_LIFETIME_S, share="s1")
    assert SIGNER.verify(SIGNER.mint(link, NOW), NOW) == link
    for access in (
        dataclasses.replace(link, share=None),
        dataclasses.replace(link, expires=NOW + MAX_SHARE_LIFETIME_S + 1),
        Access(Role.VIEW, expires=NOW + MAX_TOKEN_LIFETIME_S + 1),
        Access(Role.VIEW, expires=NOW),
        Access(Role.VIEW, session="a.b", expires=NOW + 60),
        dataclasses.replace(link, role=Role.CONTROL),
    ):
        with pytest.raises(ValueError, match="the server would reject this token"):
            SIGNER.mint(access, NOW)


def test_subject_is_cleaned() -> None:
    token = sign_token(sub="\x1b[31mai\u202eko\x00 ")
    assert SIGNER.verify(token, make_claims()["iat"]).subject == "aiko"


@given(st.text(max_size=300) | st.binary(max_size=300).map(lambda data: data.decode("latin-1")))
def test_arbitrary_text_is_rejected(text: str) -> None:
    with pytest.raises(InvalidToken):
        SIGNER.verify(text, NOW)


@given(position=st.integers(0, 10_000), letter=st.sampled_from(string.ascii_letters + string.digits + "-_"))
def test_changed_letter_never_grants_other_access(position: int, letter: str) -> None:
    token = SIGNER.mint(Access(Role.VIEW, "guest", session="s", expires=NOW + 60), NOW)
    position %= len(token)
    changed = token[:position] + letter + token[position + 1 :]
    try:
        access = SIGNER.verify(changed, NOW)
    except InvalidToken:
        return
    # the last letter has unused bits
    assert access == SIGNER.verify(token, NOW)


def test_previous_secret_verifies_but_does_not_sign() -> None:
    old = TokenSigner(OTHER_SECRET).mint(Access(Role.VIEW, expires=NOW + 60), NOW)
    both = TokenSigner(SECRET, OTHER_SECRET)
    assert both.verify(old, NOW).role is Role.VIEW
    new = both.mint(Access(Role.VIEW, expires=NOW + 60), NOW)
    assert SIGNER.verify(new, NOW).role is Role.VIEW
    with pytest.raises(InvalidToken):
        TokenSigner(OTHER_SECRET).verify(new, NOW)


def test_short_secret_or_missing_expiry_raises() -> None:
    with pytest.raises(ValueError, match="has 31 bytes, but at least 32"):
        TokenSigner("x" * 31)
    with pytest.raises(ValueError, match="at least 32"):
        TokenSigner(SECRET, "short")
    with pytest.raises(ValueError, match="expiry time"):
        SIGNER.mint(Access(Role.VIEW), NOW)


def test_helper_signs_a_valid_token_by_default() -> None:
    assert SIGNER.verify(sign_token(), make_claims()["iat"]).role is Role.ADMIN
