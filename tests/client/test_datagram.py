from __future__ import annotations

import pytest

from bunraku.client.datagram import AddressError, DatagramSender, parse_address
from tests.datagrams import receive_datagrams


@pytest.mark.parametrize(
    ("address", "expected"),
    [
        ("127.0.0.1:39540", ("127.0.0.1", 39540)),
        ("studio.local", ("studio.local", 39539)),
        ("[::1]:9000", ("::1", 9000)),
        ("[fe80::1%eth0]", ("fe80::1%eth0", 39539)),
        ("2.255.255.255:6454", ("2.255.255.255", 6454)),
    ],
)
def test_address_has_host_and_port(address: str, expected: tuple[str, int]) -> None:
    assert parse_address(address, 39539) == expected


@pytest.mark.parametrize(
    "address",
    [
        "",
        ":9000",
        "host:",
        "host:0",
        "host:65536",
        "host:-1",
        "host:port",
        "udp://host:9000",
        "host:9000/a",
        "a@b:1",
        "::1",
    ],
)
def test_invalid_address_is_rejected_with_an_example(address: str) -> None:
    with pytest.raises(AddressError, match=r"such as 127\.0\.0\.1:39539"):
        parse_address(address, 39539)


def test_port_is_required_without_a_default() -> None:
    with pytest.raises(AddressError, match="'studio' has no port"):
        parse_address("studio")


async def test_datagrams_arrive_and_are_counted() -> None:
    async with receive_datagrams() as receiver, DatagramSender("127.0.0.1", receiver.port) as sender:
        for datagram in (b"one", b"two"):
            sender.send(datagram)
        await receiver.wait_until(lambda received: len(received) == 2)
    assert receiver.received == [b"one", b"two"]
    assert (sender.sent, sender.sent_bytes, sender.dropped, sender.problem) == (2, 6, 0, None)


async def test_missing_receiver_is_reported_and_may_start_later() -> None:
    async with receive_datagrams() as receiver:
        port = receiver.port
    async with DatagramSender("127.0.0.1", port) as sender:
        for _ in range(20):
            sender.send(b"nobody")
        assert sender.dropped > 0
        assert sender.problem == f"no program listens at 127.0.0.1, port {port}"
        async with receive_datagrams(port) as receiver:
            sender.send(b"somebody")
            await receiver.wait_until(lambda received: b"somebody" in received)


async def test_datagram_beyond_the_limit_is_dropped_with_the_reason() -> None:
    async with receive_datagrams() as receiver, DatagramSender("127.0.0.1", receiver.port) as sender:
        sender.send(bytes(1 << 16))
    assert (sender.sent, sender.dropped) == (0, 1)
    assert sender.problem == "Message too long"


async def test_unknown_host_is_an_address_error() -> None:
    with pytest.raises(AddressError, match=r"nothing\.invalid"):
        async with DatagramSender("nothing.invalid", 9):
            pass


async def test_sending_before_entering_is_an_error() -> None:
    with pytest.raises(RuntimeError, match="async with"):
        DatagramSender("127.0.0.1", 9).send(b"")
