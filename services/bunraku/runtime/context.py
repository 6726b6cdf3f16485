"""Catalogue, library, bus, register, gate and clock, opened together: what every service is given."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

from bunraku.http.authentication import Authenticator
from bunraku.messaging.bus import Bus, MemoryBus
from bunraku.messaging.key_value import KeyValueStore, MemoryKeyValueStore
from bunraku.runtime.clock import clock
from bunraku.runtime.metrics import Metrics
from bunraku.runtime.settings import Settings
from bunraku.storage.catalogue import Catalogue
from bunraku.storage.motion_store import MotionStore


@dataclass(frozen=True, slots=True)
class ServiceContext:
    """What a service stands on."""

    settings: Settings
    catalogue: Catalogue
    motion_store: MotionStore
    bus: Bus
    key_values: KeyValueStore
    authenticator: Authenticator
    metrics: Metrics = field(default_factory=Metrics)
    clock: Callable[[], int] = clock
    """Reference clock, microseconds since 1970."""


@asynccontextmanager
async def open_context(settings: Settings) -> AsyncIterator[ServiceContext]:
    """Open everything at the addresses in `settings`, and close it again; raises ValueError for what is no address.

    Nothing need be there yet: what is away is tried again when it is used, or goes on being tried.
    """
    settings.data.mkdir(parents=True, exist_ok=True)
    catalogue = Catalogue(settings.catalogue_url())
    library = MotionStore.open(settings.library_url())
    bus, register = await _open_messaging(settings.bus, settings.register_replicas)
    gate = Authenticator(settings, catalogue, bus)
    backing = ServiceContext(settings, catalogue, library, bus, register, gate)
    backing.metrics.gauge("bus_up", "Whether the bus can be used now", lambda: bus.is_connected)
    backing.metrics.counter("bus_reconnects_total", "Times that the bus came back", lambda: bus.reconnects)
    try:
        yield backing
    finally:
        gate.close()
        await register.close()
        await bus.close()
        await catalogue.close()


async def _open_messaging(url: str, replicas: int) -> tuple[Bus, KeyValueStore]:
    """The bus and the register at one address."""
    if url == "memory:":
        return MemoryBus(), MemoryKeyValueStore()
    # imported here, as most processes have no use for them
    from bunraku.messaging.bus_nats import NatsBus
    from bunraku.messaging.key_value_nats import NatsKeyValueStore

    bus = NatsBus(url)
    await bus.open()
    return bus, NatsKeyValueStore(bus, replicas)
