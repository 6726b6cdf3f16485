"""Addresses of NATS servers (BUNRAKU_BUS)."""

from __future__ import annotations

from dataclasses import dataclass
from urllib.parse import parse_qsl, unquote, urlsplit

_EXPECTED = "expected memory: or nats://host:port or tls://host:port, more servers after commas"
_TLS_OPTIONS = ("ca", "cert", "key", "handshake")


@dataclass(frozen=True, slots=True)
class TlsOptions:
    """Encryption of a connection. Paths are PEM files; without `ca` the authorities of the system are trusted."""

    ca: str = ""
    certificate: str = ""
    """Certificate of this client, for servers that ask for one; `key` is its private key."""
    key: str = ""
    handshake_first: bool = False
    """Start TLS before the server's INFO, as `handshake_first` in the configuration of the server."""


@dataclass(frozen=True, slots=True)
class NatsServer:
    """Address of a server; `login` holds the credentials as fields of CONNECT.

    With `tls`, nothing is sent unencrypted. Without, the connection is encrypted if the server offers it.
    """

    host: str
    port: int
    login: dict[str, str]
    tls: TlsOptions | None = None


def parse_servers(url: str) -> list[NatsServer]:
    """Parse `nats://one:4222,user:password@two:4222` or `tls://one,two?ca=FILE`; raise ValueError if it is invalid.

    The query applies to all servers: `ca`, `cert` and `key` name files, `handshake=first`. Schemes cannot be mixed.
    """
    scheme, _, rest = url.partition("://")
    addresses, _, query = rest.partition("?")
    tls = _parse_tls_options(query) if scheme == "tls" else None
    if query and tls is None:
        raise ValueError("invalid bus address: the options after ? need tls:// instead of nats://")
    servers = []
    for address in addresses.split(","):
        try:
            parts = urlsplit(f"nats://{address.removeprefix(f'{scheme}://')}")
            # reading the port validates it
            valid = scheme in ("nats", "tls") and parts.hostname and parts.port != 0 and parts.path in ("", "/")
        except ValueError:
            valid = False
        if not valid:
            # without the address, which may contain a password
            raise ValueError(f"invalid bus address, {_EXPECTED}")
        login = {}
        if parts.username and parts.password is None:
            login = {"auth_token": unquote(parts.username)}
        elif parts.username:
            login = {"user": unquote(parts.username), "pass": unquote(parts.password or "")}
        servers.append(NatsServer(str(parts.hostname), parts.port or 4222, login, tls))
    return servers


def _parse_tls_options(query: str) -> TlsOptions:
    # a plus sign in a path is not a space
    options = dict(parse_qsl(query.replace("+", "%2B"), keep_blank_values=True))
    if unknown := sorted(options.keys() - set(_TLS_OPTIONS)):
        raise ValueError(f"invalid bus address: unknown option {unknown[0]!r}, expected {', '.join(_TLS_OPTIONS)}")
    if options.get("handshake", "first") != "first":
        raise ValueError("invalid bus address: the only value of handshake is first")
    certificate, key = options.get("cert", ""), options.get("key", "")
    if key and not certificate:
        raise ValueError("invalid bus address: the option key needs cert")
    return TlsOptions(options.get("ca", ""), certificate, key, "handshake" in options)
