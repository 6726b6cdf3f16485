from __future__ import annotations

from pathlib import Path

import pytest

from bunraku.backing.backing import clock, open_backing
from bunraku.backing.settings import Settings
from tests.backing.test_bus import Heard, settled
from tests.processes import nats_server, url_of


def test_the_clock_never_runs_back() -> None:
    times = [clock() for _ in range(1000)]
    assert times == sorted(times)
    assert 1_700_000_000_000_000 < times[0] < 1 << 53


async def test_everything_is_opened_where_the_settings_say(tmp_path: Path) -> None:
    async with open_backing(Settings(data=tmp_path / "new" / "folder")) as backing:
        assert await backing.catalogue.page(1) == ([], None)
    assert (tmp_path / "new" / "folder" / "catalogue.sqlite").exists()


async def test_a_bus_between_processes_is_at_a_url(tmp_path: Path) -> None:
    with nats_server(tmp_path) as server:
        settings = Settings(data=tmp_path, bus=url_of(server))
        async with open_backing(settings) as one, open_backing(settings) as two:
            heard = Heard()
            one.bus.subscribe("a", heard)
            await settled(one.bus)
            two.bus.publish("a", b"1")
            assert await heard.until(b"1") == [b"1"]


async def test_an_unknown_bus_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="memory:"):
        async with open_backing(Settings(data=tmp_path, bus="carrier-pigeon:")):
            pass
