"""TLS options in the URL of a PostgreSQL catalogue (libpq, 33.1.2: sslmode and the other parameters of SSL)."""

from __future__ import annotations

from typing import NamedTuple
from urllib.parse import parse_qsl, urlencode

TLS_MODES = ("disable", "allow", "prefer", "require", "verify-ca", "verify-full")
"""Values of `sslmode`."""
_FILE_OPTIONS = ("sslrootcert", "sslcert", "sslkey", "sslcrl")


class PostgresUrl(NamedTuple):
    """A URL without its TLS options, and these apart."""

    base: str
    tls_dsn: str
    """URL with the TLS options only, in the syntax of libpq; empty if there are none."""
    files: tuple[str, ...]
    """Files that the options name."""


def split_tls_options(url: str) -> PostgresUrl:
    """Separate the options that begin with `ssl`, which asyncpg understands and SQLAlchemy does not pass on.

    `ssl` is another name of `sslmode`. Raise ValueError for an invalid `sslmode`.
    """
    base, _, query = url.partition("?")
    # a plus sign in a path is not a space
    options = parse_qsl(query.replace("+", "%2B"), keep_blank_values=True)
    tls = {"sslmode" if name == "ssl" else name: value for name, value in options if name.startswith("ssl")}
    mode = tls.get("sslmode", TLS_MODES[0])
    if mode not in TLS_MODES:
        raise ValueError(f"invalid catalogue URL: sslmode is {mode[:40]!r}, expected {', '.join(TLS_MODES)}")
    rest = urlencode([(name, value) for name, value in options if not name.startswith("ssl")])
    files = tuple(tls[name] for name in _FILE_OPTIONS if tls.get(name))
    return PostgresUrl(f"{base}?{rest}" if rest else base, f"postgresql://?{urlencode(tls)}" if tls else "", files)
