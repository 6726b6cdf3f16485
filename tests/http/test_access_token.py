from __future__ import annotations

import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.http.access_control import Access, Role
from bunraku.http.access_token import MAX_TOKEN_LENGTH, InvalidToken, TokenSigner
from tests.credentials import OTHER_SECRET, SECRET, make_claims, make_unsigned_token, sign_token

NOW = 1_800_000_000
IDS = st.text(string.ascii_letters + string.digits + "_-", min_size=1, max_size=64)
SIGNER = TokenSigner(SECRET)


@given(
    role=st.sampled_from(Role),
    subject=st.text(max_size=64),
    session=st.none() | IDS,
    motion=st.none() | IDS,
    share=st.none() | IDS,
    seconds=st.integers(1, 10**7),
)
def test_minted_token_verifies_until_it_expires(
    role: Role, subject: str, session: str | None, motion: str | None, share: str | None, seconds: int
) -> None:
    access = Access(role, subject, session, motion, NOW + seconds, share)
    if access.is_bound and role > Role.CONTROL:
        with pytest.raises(ValueError, match="cannot be bound"):
            SIGNER.mint(access, NOW)
        return
    token = SIGNER.mint(access, NOW)
    if len(token) <= MAX_TOKEN_LENGTH:
        assert SIGNER.verify(token, NOW) == SIGNER.verify(token, NOW + seconds - 1) == access
        with pytest.raises(InvalidToken) as bad:
            SIGNER.verify(token, NOW + seconds)
        assert bad.value.reason == "expired"


@pytest.mark.parametrize(
    ("token", "detail"),
    [
        (sign_token(OTHER_SECRET), "not signed by this server"),
        (sign_token(aud="other"), "another audience"),
        (sign_token(aud=None), "lacks the claim aud"),
        (sign_token(iss="other"), "another issuer"),
        (sign_token(exp=None), "lacks the claim exp"),
        (sign_token(jti=None), "lacks the claim jti"),
        (sign_token(sub=None), "lacks the claim sub"),
        (sign_token(iat=None), "lacks the claim iat"),
        (sign_token(exp=True), "expiry time is not a number"),
        (sign_token(exp="9999999999"), "not a "),
        (sign_token(exp=float("inf")), "not a "),
        (sign_token(role="owner"), "unknown role"),
        (sign_token(role=["admin"]), "unknown role"),
        (sign_token(role="view", session="a.b"), "session in a token must be an id"),
        (sign_token(role="view", motion=5), "motion in a token must be an id"),
        (sign_token(role="admin", motion="m"), "cannot be bound"),
        (sign_token(sub="x" * 65), "subject"),
        (sign_token(algorithm="HS384"), "not signed with HS256"),
        (sign_token(algorithm="HS512"), "not signed with HS256"),
        (make_unsigned_token(), "not signed with HS256"),
        ("", "not a JSON Web Token"),
        ("a.b.c", "not a JSON Web Token"),
        ("x" * (MAX_TOKEN_LENGTH + 1), "characters"),
    ],
)
def test_invalid_token_is_rejected_with_a_reason(token: str, detail: str) -> None:
    with pytest.raises(InvalidToken, match=detail) as bad:
        SIGNER.verify(token, make_claims()["iat"])
    assert bad.value.reason == "invalid"


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
