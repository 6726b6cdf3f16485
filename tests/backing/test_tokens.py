from __future__ import annotations

import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.backing.access import Access, Role
from bunraku.backing.tokens import LONGEST, BadToken, Tokens
from tests.guests import OTHER, SECRET, claims, signed, unsigned

NOW = 1_800_000_000
WORDS = st.text(string.ascii_letters + string.digits + "_-", min_size=1, max_size=64)
TOKENS = Tokens(SECRET)


@given(
    role=st.sampled_from(Role),
    subject=st.text(max_size=64),
    session=st.none() | WORDS,
    motion=st.none() | WORDS,
    share=st.none() | WORDS,
    seconds=st.integers(1, 10**7),
)
def test_what_is_minted_is_read_until_it_expires(
    role: Role, subject: str, session: str | None, motion: str | None, share: str | None, seconds: int
) -> None:
    access = Access(role, subject, session, motion, NOW + seconds, share)
    if access.bound and role > Role.CONTROL:
        with pytest.raises(ValueError, match="bound to none"):
            TOKENS.mint(access, NOW)
        return
    token = TOKENS.mint(access, NOW)
    if len(token) <= LONGEST:
        assert TOKENS.read(token, NOW) == TOKENS.read(token, NOW + seconds - 1) == access
        with pytest.raises(BadToken) as bad:
            TOKENS.read(token, NOW + seconds)
        assert bad.value.reason == "expired"


@pytest.mark.parametrize(
    ("token", "detail"),
    [
        (signed(OTHER), "not signed by this server"),
        (signed(aud="other"), "another audience"),
        (signed(aud=None), "says no aud"),
        (signed(iss="other"), "another issuer"),
        (signed(exp=None), "says no exp"),
        (signed(jti=None), "says no jti"),
        (signed(sub=None), "says no sub"),
        (signed(iat=None), "says no iat"),
        (signed(exp=True), "expiry is no number"),
        (signed(exp="9999999999"), "no"),
        (signed(exp=float("inf")), "no"),
        (signed(role="owner"), "no role"),
        (signed(role=["admin"]), "no role"),
        (signed(role="view", session="a.b"), "session is no id"),
        (signed(role="view", motion=5), "motion is no id"),
        (signed(role="admin", motion="m"), "bound to nothing"),
        (signed(sub="x" * 65), "subject"),
        (signed(algorithm="HS384"), "not signed with HS256"),
        (signed(algorithm="HS512"), "not signed with HS256"),
        (unsigned(), "not signed with HS256"),
        ("", "no token"),
        ("a.b.c", "no token"),
        ("x" * (LONGEST + 1), "characters"),
    ],
)
def test_all_else_is_refused_with_the_reason(token: str, detail: str) -> None:
    with pytest.raises(BadToken, match=detail) as bad:
        TOKENS.read(token, claims()["iat"])
    assert bad.value.reason == "invalid"


@given(st.text(max_size=300) | st.binary(max_size=300).map(lambda data: data.decode("latin-1")))
def test_no_text_at_all_gets_further_than_being_refused(text: str) -> None:
    with pytest.raises(BadToken):
        TOKENS.read(text, NOW)


@given(place=st.integers(0, 10_000), letter=st.sampled_from(string.ascii_letters + string.digits + "-_"))
def test_a_token_with_one_letter_changed_allows_no_more(place: int, letter: str) -> None:
    token = TOKENS.mint(Access(Role.VIEW, "guest", session="s", expires=NOW + 60), NOW)
    place %= len(token)
    changed = token[:place] + letter + token[place + 1 :]
    try:
        found = TOKENS.read(changed, NOW)
    except BadToken:
        return
    # the last letter has bits that say nothing
    assert found == TOKENS.read(token, NOW)


def test_the_secret_before_is_read_and_not_signed_with() -> None:
    old = Tokens(OTHER).mint(Access(Role.VIEW, expires=NOW + 60), NOW)
    both = Tokens(SECRET, OTHER)
    assert both.read(old, NOW).role is Role.VIEW
    new = both.mint(Access(Role.VIEW, expires=NOW + 60), NOW)
    assert TOKENS.read(new, NOW).role is Role.VIEW
    with pytest.raises(BadToken):
        Tokens(OTHER).read(new, NOW)


def test_a_secret_is_long_and_a_token_ends() -> None:
    with pytest.raises(ValueError, match="at least 32 bytes, this has 31"):
        Tokens("x" * 31)
    with pytest.raises(ValueError, match="at least 32"):
        Tokens(SECRET, "short")
    with pytest.raises(ValueError, match="expires"):
        TOKENS.mint(Access(Role.VIEW), NOW)


def test_claims_of_the_tests_are_good_but_for_what_they_change() -> None:
    assert TOKENS.read(signed(), claims()["iat"]).role is Role.ADMIN
