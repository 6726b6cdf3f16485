from __future__ import annotations

import pytest

from bunraku.ingest.admission import AdmissionLimit
from bunraku.runtime.problem import ProblemError


def test_operation_beyond_the_limit_gets_503() -> None:
    limit = AdmissionLimit("uploads", 1)
    with limit:
        assert limit.active_count == 1
        with pytest.raises(ProblemError, match="1 uploads are in progress") as raised, limit:
            pytest.fail("admitted")
        assert (raised.value.status, raised.value.title) == (503, "Busy")
        assert limit.active_count == 1
    with limit:
        assert limit.active_count == 1


def test_failed_operation_is_no_longer_counted() -> None:
    limit = AdmissionLimit("uploads")
    with pytest.raises(KeyError), limit:
        raise KeyError
    assert limit.active_count == 0
