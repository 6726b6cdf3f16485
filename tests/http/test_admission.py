from __future__ import annotations

import pytest
from starlette.requests import HTTPConnection

from bunraku.http.access_control import ACCESS_SCOPE_KEY, Access, Role
from bunraku.http.admission import AdmissionLimit, holder_of
from bunraku.runtime.problem import ProblemError


def test_operation_beyond_the_limit_gets_503() -> None:
    limit = AdmissionLimit("uploads", 1, 1)
    with limit.admit("aiko"):
        assert limit.active_count == 1
        with pytest.raises(ProblemError, match="1 uploads are in progress") as raised, limit.admit("ben"):
            pytest.fail("admitted")
        assert (raised.value.status, raised.value.title) == (503, "Busy")
        assert limit.active_count == 1
    with limit.admit("ben"):
        assert limit.active_count == 1


def test_holder_beyond_its_share_gets_503_and_others_are_admitted() -> None:
    limit = AdmissionLimit("uploads", 4, 2)
    with limit.admit("aiko"), limit.admit("aiko"):
        with pytest.raises(ProblemError, match="you have 2 uploads in progress"), limit.admit("aiko"):
            pytest.fail("admitted")
        with limit.admit("ben"), limit.admit(""):
            assert limit.active_count == 4
    with limit.admit("aiko"):
        assert limit.active_count == 1


def test_failed_operation_is_no_longer_counted() -> None:
    limit = AdmissionLimit("uploads", 1, 1)
    with pytest.raises(KeyError), limit.admit("aiko"):
        raise KeyError
    assert limit.active_count == 0


@pytest.mark.parametrize(
    ("subject", "address", "holder"),
    [
        ("aiko", "10.0.0.1", "aiko"),
        ("", "10.0.0.1", "10.0.0.1"),
        ("", "::ffff:10.0.0.1", "10.0.0.1"),
        ("", "2001:db8::7:8:9:a", "2001:db8::"),
    ],
)
def test_holder_is_the_subject_or_else_the_network(subject: str, address: str, holder: str) -> None:
    access = Access(Role.INGEST, subject)
    assert (
        holder_of(HTTPConnection({"type": "http", "client": (address, 5_000), ACCESS_SCOPE_KEY: access, "headers": []}))
        == holder
    )


def test_request_without_an_address_has_no_holder() -> None:
    assert holder_of(HTTPConnection({"type": "http", "headers": []})) == ""
