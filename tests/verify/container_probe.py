"""Measurements inside the stack, run by the Python of the image: the source is read from standard input.

With the argument `hop`: latency of messages from one publisher through the bus to a subscriber. With the id of a
session: whether an input was applied to its marionette more than once, by its input log.
"""

import asyncio
import json
import sys
import time

import msgpack

from bunraku.messaging.bus_nats import NatsBus
from bunraku.runtime.context import open_context
from bunraku.runtime.settings import Settings

MESSAGE_COUNT = 600
MESSAGE_BYTES = 66
MESSAGE_RATE_HZ = 60.0


async def measure_bus_latency() -> dict[str, float]:
    """Measure the latency of messages of the size and rate of overlays, milliseconds."""
    one, other = NatsBus(Settings().bus), NatsBus(Settings().bus)
    latencies: list[float] = []

    def record(data: bytes) -> None:
        latencies.append((time.monotonic_ns() - int.from_bytes(data[:8], "little")) * 1e-6)

    for bus in (one, other):
        await bus.open()
    other.subscribe("verify.hop", record)
    await asyncio.sleep(0.5)
    for _ in range(MESSAGE_COUNT):
        one.publish("verify.hop", time.monotonic_ns().to_bytes(8, "little") + bytes(MESSAGE_BYTES - 8))
        await asyncio.sleep(1 / MESSAGE_RATE_HZ)
    await asyncio.sleep(0.5)
    for bus in (one, other):
        await bus.close()
    latencies.sort()
    return {
        "sent": MESSAGE_COUNT,
        "heard": len(latencies),
        "p50": latencies[len(latencies) // 2],
        "p99": latencies[len(latencies) * 99 // 100],
    }


async def count_inputs(session: str) -> dict[str, int]:
    """Count the inputs that were applied, and those applied twice."""
    from bunraku.marionette import input_log
    from bunraku.marionette.recorder import CommandKind

    async with open_context(Settings()) as context:
        reply = msgpack.unpackb(await context.bus.request(f"session.{session}.log", msgpack.packb(60.0), 10.0))
        name = reply["answer"]["log"]
        data = await context.motion_store.get_log(name)
        await context.motion_store.remove_log(name)
    assert data is not None
    seen: list[tuple[int, ...]] = []
    for segment in input_log.InputLog.unpack(data)._segments:
        offset = 0
        while offset < len(segment.records):
            kind = CommandKind(segment.records[offset])
            layout = input_log._RECORDS[kind]
            if kind is CommandKind.INPUT:
                _, puppeteer, limb, _, epoch, sequence, *_ = layout.unpack_from(segment.records, offset + 1)
                seen.append((puppeteer, limb, epoch, sequence))
            offset += 1 + layout.size
    return {"applied": len(seen), "twice": len(seen) - len(set(seen))}


argument = sys.argv[1]
print(json.dumps(asyncio.run(measure_bus_latency() if argument == "hop" else count_inputs(argument))))
