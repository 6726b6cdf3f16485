"""Catalogue, library, bus, register and clock, opened together: what every service is given."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass

from bunraku.backing.bus import Bus, MemoryBus
from bunraku.backing.catalogue import Catalogue
from bunraku.backing.library import Library
from bunraku.backing.register import MemoryRegister, Register
from bunraku.backing.settings import Settings

_BEGAN = time.time_ns() // 1000 - time.monotonic_ns() // 1000


def clock() -> int:
    """The reference clock: microseconds since 1970, carried on by the monotonic clock so that it never steps."""
    return _BEGAN + time.monotonic_ns() // 1000


@dataclass(frozen=True, slots=True)
class Backing:
    """What a service stands on."""

    settings: Settings
    catalogue: Catalogue
    library: Library
    bus: Bus
    register: Register


@asynccontextmanager
async def open_backing(settings: Settings) -> AsyncIterator[Backing]:
    """Open everything at the addresses in `settings`, and close it again."""
    if settings.bus != "memory:":
        raise ValueError(f"a bus is at memory:, not {settings.bus!r}")
    settings.data.mkdir(parents=True, exist_ok=True)
    catalogue = Catalogue(settings.catalogue_url())
    bus, register = MemoryBus(), MemoryRegister()
    try:
        yield Backing(settings, catalogue, Library.open(settings.library_url()), bus, register)
    finally:
        await register.close()
        await bus.close()
        await catalogue.close()
