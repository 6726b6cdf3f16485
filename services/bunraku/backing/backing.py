"""Catalogue, library, bus, register, gate and clock, opened together: what every service is given."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

from bunraku.backing.bus import Bus, MemoryBus
from bunraku.backing.catalogue import Catalogue
from bunraku.backing.gate import Gate
from bunraku.backing.library import Library
from bunraku.backing.metrics import Metrics
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
    gate: Gate
    metrics: Metrics = field(default_factory=Metrics)


@asynccontextmanager
async def open_backing(settings: Settings) -> AsyncIterator[Backing]:
    """Open everything at the addresses in `settings`, and close it again; raises ValueError for what is no address.

    Nothing need be there yet: what is away is tried again when it is used, or goes on being tried.
    """
    settings.data.mkdir(parents=True, exist_ok=True)
    catalogue = Catalogue(settings.catalogue_url())
    library = Library.open(settings.library_url())
    bus, register = await _open_bus(settings.bus, settings.register_replicas)
    gate = Gate(settings, catalogue, bus)
    backing = Backing(settings, catalogue, library, bus, register, gate)
    backing.metrics.gauge("bus_up", "Whether the bus can be used now", lambda: bus.up)
    backing.metrics.counter("bus_reconnects_total", "Times that the bus came back", lambda: bus.returns)
    try:
        yield backing
    finally:
        gate.close()
        await register.close()
        await bus.close()
        await catalogue.close()


async def _open_bus(url: str, replicas: int) -> tuple[Bus, Register]:
    """The bus and the register at one address."""
    if url == "memory:":
        return MemoryBus(), MemoryRegister()
    # imported here, as most processes have no use for them
    from bunraku.backing.bus_nats import NatsBus
    from bunraku.backing.register_nats import NatsRegister

    bus = NatsBus(url)
    await bus.open()
    return bus, NatsRegister(bus, replicas)
