from __future__ import annotations

import pytest
from starlette.requests import HTTPConnection

from bunraku.http.access_control import (
    ACCESS_SCOPE_KEY,
    DEFAULT_MAX_BODY_BYTES,
    FULL_ACCESS,
    Access,
    Requirement,
    Role,
    access_of,
    requirement_of,
    requires,
)


def test_each_role_has_a_word_and_is_more_than_the_one_before() -> None:
    words = [role.label for role in Role]
    assert words == ["view", "control", "ingest", "admin"]
    assert [Role.parse(word) for word in words] == sorted(Role)
    with pytest.raises(ValueError, match="view, control, ingest, admin"):
        Role.parse("owner")


def test_what_a_route_needs_stands_beside_it() -> None:
    @requires(Role.VIEW, allow_bound=True)
    def endpoint() -> None: ...

    assert requirement_of(endpoint) == Requirement(Role.VIEW, True, DEFAULT_MAX_BODY_BYTES)
    assert requirement_of(test_what_a_route_needs_stands_beside_it) is None


def test_without_a_guard_everything_is_allowed() -> None:
    assert access_of(HTTPConnection({"type": "http"})) == FULL_ACCESS
    assert access_of(HTTPConnection({"type": "http", ACCESS_SCOPE_KEY: Access(Role.VIEW)})) == Access(Role.VIEW)
