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
def test_what_is_minted_is_read_until_it_expires(
    role: Role, subject: str, session: str | None, motion: str | None, share: str | None, seconds: int
) -> None:
    access = Access(role, subject, session, motion, NOW + seconds, share)
    if access.is_bound and role > Role.CONTROL:
        with pytest.raises(ValueError, match="bound to none"):
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
        (sign_token(aud=None), "says no aud"),
        (sign_token(iss="other"), "another issuer"),
        (sign_token(exp=None), "says no exp"),
        (sign_token(jti=None), "says no jti"),
        (sign_token(sub=None), "says no sub"),
        (sign_token(iat=None), "says no iat"),
        (sign_token(exp=True), "expiry is no number"),
        (sign_token(exp="9999999999"), "no"),
        (sign_token(exp=float("inf")), "no"),
        (sign_token(role="owner"), "no role"),
        (sign_token(role=["admin"]), "no role"),
        (sign_token(role="view", session="a.b"), "session is no id"),
        (sign_token(role="view", motion=5), "motion is no id"),
        (sign_token(role="admin", motion="m"), "bound to nothing"),
        (sign_token(sub="x" * 65), "subject"),
        (sign_token(algorithm="HS384"), "not signed with HS256"),
        (sign_token(algorithm="HS512"), "not signed with HS256"),
        (make_unsigned_token(), "not signed with HS256"),
        ("", "no token"),
        ("a.b.c", "no token"),
        ("x" * (MAX_TOKEN_LENGTH + 1), "characters"),
    ],
)
def test_all_else_is_refused_with_the_reason(token: str, detail: str) -> None:
    with pytest.raises(InvalidToken, match=detail) as bad:
        SIGNER.verify(token, make_claims()["iat"])
    assert bad.value.reason == "invalid"


@given(st.text(max_size=300) | st.binary(max_size=300).map(lambda data: data.decode("latin-1")))
def test_no_text_at_all_gets_further_than_being_refused(text: str) -> None:
    with pytest.raises(InvalidToken):
        SIGNER.verify(text, NOW)


@given(place=st.integers(0, 10_000), letter=st.sampled_from(string.ascii_letters + string.digits + "-_"))
def test_a_token_with_one_letter_changed_allows_no_more(place: int, letter: str) -> None:
    token = SIGNER.mint(Access(Role.VIEW, "guest", session="s", expires=NOW + 60), NOW)
    place %= len(token)
    changed = token[:place] + letter + token[place + 1 :]
    try:
        found = SIGNER.verify(changed, NOW)
    except InvalidToken:
        return
    # the last letter has bits that say nothing
    assert found == SIGNER.verify(token, NOW)


def test_the_secret_before_is_read_and_not_signed_with() -> None:
    old = TokenSigner(OTHER_SECRET).mint(Access(Role.VIEW, expires=NOW + 60), NOW)
    both = TokenSigner(SECRET, OTHER_SECRET)
    assert both.verify(old, NOW).role is Role.VIEW
    new = both.mint(Access(Role.VIEW, expires=NOW + 60), NOW)
    assert SIGNER.verify(new, NOW).role is Role.VIEW
    with pytest.raises(InvalidToken):
        TokenSigner(OTHER_SECRET).verify(new, NOW)


def test_a_secret_is_long_and_a_token_ends() -> None:
    with pytest.raises(ValueError, match="at least 32 bytes, this has 31"):
        TokenSigner("x" * 31)
    with pytest.raises(ValueError, match="at least 32"):
        TokenSigner(SECRET, "short")
    with pytest.raises(ValueError, match="expires"):
        SIGNER.mint(Access(Role.VIEW), NOW)


def test_claims_of_the_tests_are_good_but_for_what_they_change() -> None:
    assert SIGNER.verify(sign_token(), make_claims()["iat"]).role is Role.ADMIN
