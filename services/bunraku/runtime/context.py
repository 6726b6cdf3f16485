"""Backends, clock and metrics that every service is created with."""

from __future__ import annotations

import asyncio
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
from bunraku.storage.object_folder import make_durable_folder


class DataFolderError(Exception):
    """The data folder cannot be created."""


def _completed() -> asyncio.Event:
    event = asyncio.Event()
    event.set()
    return event


@dataclass(frozen=True, slots=True)
class ServiceContext:
    """Dependencies of a service: settings, backends, access control, metrics and clock.

    The services of one process share one context. Tests replace single fields.
    """

    settings: Settings
    """Addresses and limits of the process."""
    catalogue: Catalogue
    """Rows of motions, viewer links and pending jobs."""
    motion_store: MotionStore
    """Objects: encoded motions, uploaded files, session logs, notes."""
    bus: Bus
    """Messages and requests between services."""
    key_values: KeyValueStore
    """State on which replicas must agree, with revisions: session ownership, leases."""
    authenticator: Authenticator
    """Verification of tokens, tickets and viewer links."""
    metrics: Metrics = field(default_factory=Metrics)
    """Metrics of the process, for Prometheus."""
    clock: Callable[[], int] = clock
    """Reference clock, microseconds since 1970."""
    kernels_compiled: asyncio.Event = field(default_factory=_completed)
    """Not set while the kernels are compiled for the first time on this machine."""


@asynccontextmanager
async def open_context(settings: Settings) -> AsyncIterator[ServiceContext]:
    """Open the backends at the addresses in `settings` and close them at the end.

    A backend may still be unavailable: it is tried again when it is used, or in the background. Raise ValueError for an
    invalid address, or `DataFolderError`.
    """
    try:
        make_durable_folder(settings.data.resolve())
    except OSError as error:
        hint = "Choose another with --data or BUNRAKU_DATA."
        raise DataFolderError(f"Cannot create the data folder {settings.data}: {error.strerror}. {hint}") from error
    catalogue = Catalogue(settings.catalogue_url())
    motion_store = MotionStore.open(settings.library_url())
    bus, key_values = await _open_messaging(settings.bus, settings.register_replicas)
    authenticator = Authenticator(settings, catalogue, bus)
    context = ServiceContext(settings, catalogue, motion_store, bus, key_values, authenticator)
    context.metrics.gauge("bus_up", "Whether the bus is connected", lambda: bus.is_connected)
    context.metrics.counter("bus_reconnects_total", "Reconnections of the bus", lambda: bus.reconnects)
    try:
        yield context
    finally:
        authenticator.close()
        await key_values.close()
        await bus.close()
        await catalogue.close()


async def _open_messaging(url: str, replicas: int) -> tuple[Bus, KeyValueStore]:
    if url == "memory:":
        return MemoryBus(), MemoryKeyValueStore()
    # imported here, as a single process does not need them
    from bunraku.messaging.bus_nats import NatsBus
    from bunraku.messaging.key_value_nats import NatsKeyValueStore

    bus = NatsBus(url)
    await bus.open()
    return bus, NatsKeyValueStore(bus, replicas)
