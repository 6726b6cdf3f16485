"""Connections of SQLAlchemy to the catalogue, encrypted as its URL says."""

from __future__ import annotations

import ssl
from typing import Any

from sqlalchemy.engine import make_url
from sqlalchemy.ext.asyncio import AsyncEngine, create_async_engine

from bunraku.runtime.tls import describe_tls_error, require_readable
from bunraku.storage.postgres_url import PostgresUrl, split_tls_options


def create_engine(url: str, connect_args: dict[str, Any] | None = None, **options: Any) -> AsyncEngine:
    """Return an engine for an SQLAlchemy URL with an async driver; PostgreSQL takes the TLS options of libpq.

    Connecting raises ConnectionError with the remedy if the TLS options of the URL cannot be met.
    """
    connect_args = dict(connect_args or {})
    if url.startswith("postgresql"):
        postgres_url = split_tls_options(url)
        url = postgres_url.base
        if postgres_url.tls_dsn:
            connect_args["async_creator_fn"] = _tls_connector(postgres_url, make_url(url).host or "the database")
    return create_async_engine(url, connect_args=connect_args, **options)


def _tls_connector(url: PostgresUrl, host: str) -> Any:
    # imported here, as SQLite does not need it
    import asyncpg

    async def connect(*arguments: Any, **options: Any) -> Any:
        for path in url.files:
            require_readable(path)
        try:
            return await asyncpg.connect(*arguments, dsn=url.tls_dsn, **options)
        except ssl.SSLError as error:
            raise ConnectionError(describe_tls_error(error, host)) from error
        except asyncpg.exceptions.ClientConfigurationError as error:
            raise ConnectionError(f"the TLS options of the catalogue URL are invalid: {error}") from error
        except ConnectionError as error:
            if "rejected SSL upgrade" not in str(error):
                raise
            raise ConnectionError(
                f"{host} does not offer TLS: set ssl = on in its configuration, or correct sslmode in the catalogue URL"
            ) from error

    return connect
