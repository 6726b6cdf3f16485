from __future__ import annotations

import pytest
from starlette.requests import HTTPConnection

from bunraku.backing.access import EVERYTHING, KEY, SMALL_BODY, Access, Needs, Role, access_of, needed, needs


def test_each_role_has_a_word_and_is_more_than_the_one_before() -> None:
    words = [role.word for role in Role]
    assert words == ["view", "control", "ingest", "admin"]
    assert [Role.of(word) for word in words] == sorted(Role)
    with pytest.raises(ValueError, match="view, control, ingest, admin"):
        Role.of("owner")


def test_what_a_route_needs_stands_beside_it() -> None:
    @needs(Role.VIEW, all=True)
    def endpoint() -> None: ...

    assert needed(endpoint) == Needs(Role.VIEW, True, SMALL_BODY)
    assert needed(test_what_a_route_needs_stands_beside_it) is None


def test_without_a_guard_everything_is_allowed() -> None:
    assert access_of(HTTPConnection({"type": "http"})) == EVERYTHING
    assert access_of(HTTPConnection({"type": "http", KEY: Access(Role.VIEW)})) == Access(Role.VIEW)
