"""What the API's own description allows, and what it does not, tried at random by schemathesis: never a 5xx."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import Any

import hypothesis
import pytest
import schemathesis
from hypothesis.errors import Unsatisfiable
from schemathesis.checks import not_a_server_error
from schemathesis.generation import GenerationMode

from tests.credentials import SECRET, bearer_headers, make_token
from tests.servers import run_server

EXAMPLES = 12
"""Of each operation, in each mode."""
TOTAL_TIMEOUT_S = 25.0
"""Seconds after which no more is tried."""


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with run_server(tmp_path_factory.mktemp("openapi"), secret=SECRET, connects=0, upload_seconds=2.0) as url:
        yield url


def test_nothing_that_is_asked_makes_the_server_fail(guarded: str, tally: Callable[[str], None]) -> None:
    schema = schemathesis.openapi.from_url(f"{guarded}/v1/openapi.json")
    held, begun, tried = bearer_headers(make_token(lifetime_s=3_600)), time.monotonic(), 0
    operations: list[Any] = [found.ok() for found in schema.get_all_operations()]  # type: ignore[union-attr]
    for operation in operations:
        for mode in GenerationMode:

            @hypothesis.given(case=operation.as_strategy(generation_mode=mode))
            @hypothesis.settings(
                max_examples=EXAMPLES, database=None, suppress_health_check=list(hypothesis.HealthCheck)
            )
            def ask(case: Any) -> None:
                nonlocal tried
                if time.monotonic() - begun < TOTAL_TIMEOUT_S:
                    tried += 1
                    case.call_and_validate(headers=held, checks=[not_a_server_error])

            # some cannot be asked for anything that the description forbids
            with contextlib.suppress(Unsatisfiable):
                ask()
    assert tried > 3 * len(operations)
    tally(f"schemathesis: {tried} requests to {len(operations)} operations, no 5xx")
