"""NATS over TLS, against real nats-servers with certificates of a private authority."""

from __future__ import annotations

import asyncio
import json
import socket
import ssl
import struct
import time
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
import uvloop

from bunraku.messaging import nats_connection
from bunraku.messaging.bus_nats import MAX_LOGGED_REASONS, NatsBus
from bunraku.messaging.nats_address import NatsServer, TlsOptions, parse_servers
from bunraku.messaging.nats_connection import NatsConnection, NatsMessage
from tests.certificates import Authority, CertificateFiles
from tests.messaging.message_recorder import MessageRecorder
from tests.processes import ServerProcess, run_nats_server
from tests.time_limit import HANG_TIMEOUT_S

CONNECT_TIMEOUT_S = 50.0
"""Time limit of connecting on a slow machine, below that of a TLS handshake in asyncio, 60 s."""
RUNNERS: dict[str, Callable[[Coroutine[Any, Any, None]], None]] = {"asyncio": asyncio.run, "uvloop": uvloop.run}


@pytest.fixture(autouse=True)
def _patient_handshakes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the time limit of connecting only end a handshake that hangs."""
    monkeypatch.setattr(nats_connection, "CONNECT_TIMEOUT_S", CONNECT_TIMEOUT_S)


class NoMessages:
    def on_message(self, message: NatsMessage) -> None:
        raise AssertionError(message)


@pytest.fixture
def authority(tmp_path: Path) -> Authority:
    return Authority(tmp_path)


def write_config(folder: Path, files: CertificateFiles, *options: str, more: str = "") -> Path:
    config = folder / "tls.conf"
    tls = [f'cert_file: "{files.certificate}"', f'key_file: "{files.key}"', *options]
    config.write_text(f"tls {{\n{chr(10).join(tls)}\n}}\n{more}\n")
    return config


@contextmanager
def run_tls_server(folder: Path, files: CertificateFiles, *options: str, more: str = "") -> Iterator[ServerProcess]:
    with run_nats_server(folder, "-c", str(write_config(folder, files, *options, more=more))) as server:
        yield server


@pytest.fixture
def server(tmp_path: Path, authority: Authority) -> Iterator[ServerProcess]:
    with run_tls_server(tmp_path, authority.issue("nats", "localhost", "127.0.0.1")) as process:
        yield process


async def open_error(url: str) -> str:
    """Return why a connection to the first server of a URL fails."""
    (server,) = parse_servers(url)
    with pytest.raises(ConnectionError) as raised:
        await NatsConnection.open(server, NoMessages(), [])
    return str(raised.value)


async def wait_until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while not condition():  # noqa: ASYNC110
            await asyncio.sleep(0.01)


async def exchange_messages(bus: NatsBus) -> None:
    recorder = MessageRecorder()
    bus.subscribe("a", recorder)
    expected = [b"%d" % number + bytes(1000) for number in range(2000)]
    for message in expected:
        bus.publish("a", message)
    assert await recorder.wait_for(expected[-1]) == expected


@pytest.mark.parametrize("loop", RUNNERS)
def test_messages_are_exchanged_and_restored_over_tls(loop: str, server: ServerProcess, authority: Authority) -> None:
    async def scenario() -> None:
        bus = NatsBus(f"tls://localhost:{server.port},127.0.0.1:{server.port}?ca={authority.ca}")
        try:
            await bus.open(20)
            await exchange_messages(bus)
            assert bus._connection is not None
            assert bus._connection._transport.get_extra_info("ssl_object").version() in ("TLSv1.2", "TLSv1.3")
            server.kill()
            await wait_until(lambda: not bus.is_connected)
            server.start()
            await wait_until(lambda: bus.is_connected)
            await exchange_messages(bus)
            # the send buffer stays bounded, encrypted or not
            server.pause()
            connection = bus._connection
            while bus.is_connected:
                bus.publish("a", bytes(10_000))
                assert connection.unsent_bytes <= nats_connection.MAX_UNSENT_BYTES + 40_000
                await asyncio.sleep(0)
            server.resume()
        finally:
            await bus.close()

    RUNNERS[loop](scenario())


async def test_nats_scheme_is_encrypted_if_the_server_offers_it(
    tmp_path: Path, authority: Authority, monkeypatch: pytest.MonkeyPatch
) -> None:
    # OpenSSL takes the authorities of the system from this file
    monkeypatch.setenv("SSL_CERT_FILE", str(authority.ca))
    files = authority.issue("nats", "localhost")
    for index, more in enumerate(("", "allow_non_tls: true")):
        folder = tmp_path / str(index)
        folder.mkdir()
        with run_tls_server(folder, files, more=more) as server:
            (address,) = parse_servers(f"nats://localhost:{server.port}")
            connection = await NatsConnection.open(address, NoMessages(), [])
            assert connection._transport.get_extra_info("ssl_object") is not None
            await connection.close()
    monkeypatch.delenv("SSL_CERT_FILE")
    with run_tls_server(tmp_path, files, more="allow_non_tls: true") as server:
        assert "not signed by a trusted authority" in await open_error(f"nats://localhost:{server.port}")


@pytest.mark.parametrize(
    ("hosts", "expired", "ca", "expected"),
    [
        (["localhost"], True, "authority", "has expired: renew it"),
        (["nats.example.org"], False, "authority", "is for another host"),
        (["127.0.0.1"], False, "authority", "is for another host"),
        (["localhost"], False, "other", "not signed by a trusted authority"),
        (["localhost"], False, "", "not signed by a trusted authority"),
    ],
)
async def test_invalid_certificate_is_rejected_with_the_remedy(
    hosts: list[str], expired: bool, ca: str, expected: str, tmp_path: Path, authority: Authority
) -> None:
    Authority(tmp_path, "other")
    query = f"?ca={tmp_path / ca}.crt" if ca else ""
    with run_tls_server(tmp_path, authority.issue("nats", *hosts, expired=expired)) as server:
        error = await open_error(f"tls://localhost:{server.port}{query}")
    assert error.startswith("the certificate of localhost ")
    assert expected in error


async def test_server_may_require_a_client_certificate(tmp_path: Path, authority: Authority) -> None:
    client, stranger = authority.issue("client"), Authority(tmp_path, "other").issue("stranger")
    files = authority.issue("nats", "localhost")
    with run_tls_server(tmp_path, files, f'ca_file: "{authority.ca}"', "verify: true") as server:
        url = f"tls://localhost:{server.port}?ca={authority.ca}"
        (address,) = parse_servers(f"{url}&cert={client.certificate}&key={client.key}")
        await (await NatsConnection.open(address, NoMessages(), [])).close()
        assert "certificate of this client" in await open_error(url)
        assert "certificate of this client" in await open_error(f"{url}&cert={stranger.certificate}&key={stranger.key}")


async def test_reset_instead_of_an_alert_hints_at_the_client_certificate(authority: Authority) -> None:
    files = authority.issue("nats", "localhost")
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    context.load_cert_chain(files.certificate, files.key)

    async def reset(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(b'INFO {"max_payload": 1000}\r\n')
        await reader.readuntil(b"PING\r\n")
        connected = writer.get_extra_info("socket")
        connected.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        writer.transport.abort()

    async with await asyncio.start_server(reset, "127.0.0.1", ssl=context) as listening:
        port = listening.sockets[0].getsockname()[1]
        error = await open_error(f"tls://localhost:{port}?ca={authority.ca}&handshake=first")
    assert "certificate of this client" in error


async def test_unusable_file_is_named(tmp_path: Path, server: ServerProcess, authority: Authority) -> None:
    url = f"tls://localhost:{server.port}?ca="
    assert (
        await open_error(f"{url}{tmp_path}/none.crt") == f"cannot read {tmp_path}/none.crt: No such file or directory"
    )
    empty = tmp_path / "empty.crt"
    empty.write_text("")
    assert await open_error(f"{url}{empty}") == f"{empty} holds no certificate in PEM format"
    error = await open_error(f"{url}{authority.ca}&cert={authority.ca}&key={empty}")
    assert error.startswith(f"{authority.ca} and {empty} are not a certificate")


class PlainServer:
    """Server that sends `greeting` unencrypted and records what it receives."""

    def __init__(self, greeting: bytes) -> None:
        self._greeting = greeting
        self.received = bytearray()
        self.port = 0
        self.connections: set[asyncio.Task[None]] = set()

    def accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.connections.add(asyncio.create_task(self._serve(reader, writer)))

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(self._greeting)
        with suppress(OSError):
            while data := await reader.read(4096):
                self.received += data
        writer.close()


@asynccontextmanager
async def run_plain_server(**info: object) -> AsyncIterator[PlainServer]:
    pushed = str(info.pop("pushed", "")).encode()
    plain = PlainServer(b"INFO " + json.dumps({"max_payload": 1 << 20, **info}).encode() + b"\r\n" + pushed)
    listening = await asyncio.start_server(plain.accept, "127.0.0.1", 0)
    plain.port = listening.sockets[0].getsockname()[1]
    try:
        yield plain
    finally:
        listening.close()
        # the client closes every connection
        async with asyncio.timeout(HANG_TIMEOUT_S):
            await asyncio.gather(*plain.connections)


async def open_error_of_silent_server(url: str, plain: PlainServer, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return why a connection fails whose time limit passes as soon as the server has received something."""
    loop, skipped_s = asyncio.get_running_loop(), 0.0
    with monkeypatch.context() as patch:
        patch.setattr(loop, "time", lambda: time.monotonic() + skipped_s)
        opening = asyncio.create_task(open_error(url))
        await wait_until(lambda: len(plain.received) > 0)
        skipped_s = CONNECT_TIMEOUT_S
        return await opening


async def test_credentials_are_never_sent_unencrypted_to_a_tls_address(monkeypatch: pytest.MonkeyPatch) -> None:
    async with run_plain_server() as plain:
        assert "does not offer TLS" in await open_error(f"tls://me:word@127.0.0.1:{plain.port}")
        assert not plain.received
    async with run_plain_server(tls_required=True) as plain:
        # offers TLS, but does not speak it
        await open_error_of_silent_server(f"tls://me:word@127.0.0.1:{plain.port}", plain, monkeypatch)
        assert b"word" not in plain.received
    async with run_plain_server(tls_available=True) as plain:
        await open_error_of_silent_server(f"nats://me:word@127.0.0.1:{plain.port}", plain, monkeypatch)
        assert b"word" not in plain.received


async def test_data_inserted_before_the_tls_handshake_is_rejected() -> None:
    async with run_plain_server(tls_required=True, pushed="MSG a 1 2\r\nhi\r\n") as plain:
        error = await open_error(f"tls://127.0.0.1:{plain.port}")
        assert "unencrypted data before the TLS handshake" in error
        assert not plain.received


async def test_silent_tls_handshake_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    async with run_plain_server(tls_required=True) as plain:
        url = f"tls://127.0.0.1:{plain.port}"
        assert await open_error_of_silent_server(url, plain, monkeypatch) == "the server does not respond"
        # the TLS client hello was sent, and nothing else
        assert plain.received[:1] == b"\x16"


@pytest.mark.parametrize("loop", RUNNERS)
def test_tls_handshake_may_precede_the_info(loop: str, tmp_path: Path, authority: Authority) -> None:
    """`handshake_first` of nats-server 2.10.4; here TLS is terminated in front of a server without TLS."""
    files = authority.issue("nats", "localhost")
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    context.load_cert_chain(*files)

    async def scenario() -> None:
        with run_nats_server(tmp_path) as server:

            async def forward(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
                with suppress(OSError):
                    while data := await reader.read(1 << 16):
                        writer.write(data)
                        await writer.drain()
                writer.close()

            async def relay(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
                upstream_reader, upstream_writer = await asyncio.open_connection("127.0.0.1", server.port)
                await asyncio.gather(forward(reader, upstream_writer), forward(upstream_reader, writer))

            terminator = await asyncio.start_server(relay, "127.0.0.1", 0, ssl=context)
            port = terminator.sockets[0].getsockname()[1]
            bus = NatsBus(f"tls://localhost:{port}?ca={authority.ca}&handshake=first")
            try:
                await bus.open(20)
                await exchange_messages(bus)
            finally:
                await bus.close()
                terminator.close()

    RUNNERS[loop](scenario())


async def test_wrong_order_of_handshakes_is_reported(server: ServerProcess, authority: Authority) -> None:
    error = await open_error(f"tls://localhost:{server.port}?ca={authority.ca}&handshake=first")
    # the INFO of the server arrives before or during the handshake
    assert "handshake=first" in error or "does not speak TLS here" in error


async def test_renewed_authority_is_used_at_the_next_connection(
    tmp_path: Path, server: ServerProcess, authority: Authority, caplog: pytest.LogCaptureFixture
) -> None:
    trusted = tmp_path / "trusted.crt"
    trusted.write_bytes(Authority(tmp_path, "other").ca.read_bytes())
    bus = NatsBus(f"tls://localhost:{server.port}?ca={trusted}")
    try:
        await bus.open(0.1)
        await wait_until(lambda: "not signed by a trusted authority" in caplog.text)
        trusted.write_bytes(authority.ca.read_bytes())
        await wait_until(lambda: bus.is_connected)
    finally:
        await bus.close()
    assert 1 <= caplog.text.count("Bus disconnected") <= MAX_LOGGED_REASONS


def test_tls_addresses_are_parsed() -> None:
    options = TlsOptions("/a b/ca+1.crt", "/c.crt", "/c.key", True)
    assert parse_servers("tls://a,tls://me:w%40rd@b:1?ca=/a%20b/ca+1.crt&cert=/c.crt&key=/c.key&handshake=first") == [
        NatsServer("a", 4222, {}, options),
        NatsServer("b", 1, {"user": "me", "pass": "w@rd"}, options),
    ]
    assert parse_servers("tls://a") == [NatsServer("a", 4222, {}, TlsOptions())]


@pytest.mark.parametrize(
    "url",
    [
        "tls://a,nats://b",
        "nats://a,tls://b",
        "nats://a?ca=/ca.crt",
        "tls://a?verify=no",
        "tls://a?handshake=last",
        "tls://a?key=/c.key",
        "tls://",
        "TLS://a",
    ],
)
def test_ambiguous_tls_address_is_rejected(url: str) -> None:
    with pytest.raises(ValueError, match="invalid bus address"):
        parse_servers(url)
