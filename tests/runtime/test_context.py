from __future__ import annotations

from pathlib import Path

import pytest

from bunraku.runtime.clock import clock
from bunraku.runtime.context import open_context
from bunraku.runtime.settings import Settings
from tests.messaging.test_bus import MessageRecorder, flush_buses
from tests.processes import nats_url_of, run_nats_server


def test_the_clock_never_runs_back() -> None:
    times = [clock() for _ in range(1000)]
    assert times == sorted(times)
    assert 1_700_000_000_000_000 < times[0] < 1 << 53


async def test_everything_is_opened_where_the_settings_say(tmp_path: Path) -> None:
    async with open_context(Settings(data=tmp_path / "new" / "folder")) as backing:
        assert await backing.catalogue.list_motions(1) == ([], None)
    assert (tmp_path / "new" / "folder" / "catalogue.sqlite").exists()


async def test_a_bus_between_processes_is_at_a_url(tmp_path: Path) -> None:
    with run_nats_server(tmp_path) as server:
        settings = Settings(data=tmp_path, bus=nats_url_of(server))
        async with open_context(settings) as one, open_context(settings) as two:
            heard = MessageRecorder()
            one.bus.subscribe("a", heard)
            await flush_buses(one.bus)
            two.bus.publish("a", b"1")
            assert await heard.wait_for(b"1") == [b"1"]


async def test_an_unknown_bus_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="memory:"):
        async with open_context(Settings(data=tmp_path, bus="carrier-pigeon:")):
            pass
