"""Flow control over a simulated link."""

from __future__ import annotations

from bunraku.stream.flow_control import FlowControl
from bunraku.websocket.link import LinkSample
from tests.delivery.virtual_link import VirtualLink


class SimulatedSender:
    """Flow control over a simulated link, in virtual time."""

    def __init__(self, rate: float, delay: int) -> None:
        self.at = 0
        self.reads = 0
        self.reduced_throughput: float | None = None
        self.written = 0
        self.link = VirtualLink(lambda _: self.reduced_throughput or rate, delay)
        self.round_trip = 2 * delay
        self.closed = False
        self.is_loss_based = False
        self.flow = FlowControl(self, lambda: self.at)

    def sample(self) -> LinkSample:
        self.reads += 1
        if self.closed:
            raise OSError("closed")
        return LinkSample(self.link.unacked_bytes(self.at), self.round_trip, self.round_trip, self.written)

    def probe(self, _: int) -> bytes:
        return b""

    def receive_probe_echo(self, _: bytes) -> bool:
        return False

    def set_corked(self, corked: bool) -> None:
        assert not corked

    def use_loss_based_congestion(self) -> None:
        self.is_loss_based = True

    def write(self, size: int) -> None:
        self.write_untracked(size)
        self.flow.record_write(size)

    def write_untracked(self, size: int) -> None:
        self.link.write(self.at, size)
        self.written += size
