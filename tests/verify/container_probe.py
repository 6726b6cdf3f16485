"""Latency of messages from one publisher through the bus to a subscriber, measured inside the stack.

The Python of the image runs it: the source is read from standard input.
"""

import asyncio
import json
import time

from bunraku.messaging.bus_nats import NatsBus
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


print(json.dumps(asyncio.run(measure_bus_latency())))
