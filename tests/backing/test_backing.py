from __future__ import annotations

from pathlib import Path

import pytest

from bunraku.backing.backing import clock, open_backing
from bunraku.backing.settings import Settings


def test_the_clock_never_runs_back() -> None:
    times = [clock() for _ in range(1000)]
    assert times == sorted(times)
    assert 1_700_000_000_000_000 < times[0] < 1 << 53


async def test_everything_is_opened_where_the_settings_say(tmp_path: Path) -> None:
    async with open_backing(Settings(data=tmp_path / "new" / "folder")) as backing:
        assert await backing.catalogue.page(1) == ([], None)
    assert (tmp_path / "new" / "folder" / "catalogue.sqlite").exists()


async def test_an_unknown_bus_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="memory:"):
        async with open_backing(Settings(data=tmp_path, bus="carrier-pigeon:")):
            pass
