from __future__ import annotations

from pathlib import Path

import pytest

from bunraku.runtime.clock import clock
from bunraku.runtime.context import open_context
from bunraku.runtime.settings import Settings
from tests.messaging.message_recorder import MessageRecorder, flush_buses
from tests.processes import nats_url_of, run_nats_server


def test_clock_never_runs_backwards() -> None:
    times = [clock() for _ in range(1000)]
    assert times == sorted(times)
    assert 1_700_000_000_000_000 < times[0] < 1 << 53


async def test_backends_are_opened_in_the_data_folder(tmp_path: Path) -> None:
    async with open_context(Settings(data=tmp_path / "new" / "folder")) as context:
        assert await context.catalogue.list_motions(1) == ([], None)
    assert (tmp_path / "new" / "folder" / "catalogue.sqlite").exists()


async def test_nats_url_opens_a_bus_between_processes(tmp_path: Path) -> None:
    with run_nats_server(tmp_path) as server:
        settings = Settings(data=tmp_path, bus=nats_url_of(server))
        async with open_context(settings) as one, open_context(settings) as two:
            recorder = MessageRecorder()
            one.bus.subscribe("a", recorder)
            await flush_buses(one.bus)
            two.bus.publish("a", b"1")
            assert await recorder.wait_for(b"1") == [b"1"]


async def test_unknown_bus_url_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="memory:"):
        async with open_context(Settings(data=tmp_path, bus="carrier-pigeon:")):
            pass
