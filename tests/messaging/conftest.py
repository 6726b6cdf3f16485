"""NATS server shared by the tests of one process."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.processes import nats_url_of, run_jetstream


@pytest.fixture(scope="session")
def nats_url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Return the URL of a running nats-server with JetStream."""
    with run_jetstream(tmp_path_factory.mktemp("nats")) as server:
        yield nats_url_of(server)
