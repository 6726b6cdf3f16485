"""Settings of a process: environment variables `BUNRAKU_...`, with defaults for a single machine.

`docs/operations.md` documents them for operators.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

from pydantic import Field, SecretStr, ValidationInfo, field_validator
from pydantic_settings import BaseSettings, PydanticBaseSettingsSource, SecretsSettingsSource, SettingsConfigDict

from bunraku.http.access_token import TokenSigner
from bunraku.http.client_address import TrustedProxies
from bunraku.http.origin import OPAQUE_ORIGIN, parse_origins
from bunraku.messaging.nats_address import parse_servers
from bunraku.runtime import metrics
from bunraku.storage.catalogue import Catalogue
from bunraku.storage.record import PropQuota, Quota

MEMORY_BUS = "memory:"
"""URL of the bus within one process."""
SECRETS_VARIABLE = "BUNRAKU_SECRETS"
"""Environment variable with the folder of settings that are files."""


class Settings(BaseSettings):
    """Addresses and limits of one process."""

    model_config = SettingsConfigDict(env_prefix="BUNRAKU_", hide_input_in_errors=True)

    data: Path = Path(".bunraku")
    """Folder of the embedded defaults."""
    catalogue: str = ""
    """URL of the catalogue, `sqlite:///...` or `postgresql://...`; empty: SQLite in `data`."""
    library: str = ""
    """URL of the object store for motions, `file:///...`, `s3://...` or another that obstore supports; empty: a
    folder in `data`."""
    bus: str = MEMORY_BUS
    """URL of the bus: `memory:` for one process, or `nats://...` with further servers after commas."""
    register_replicas: int = Field(default=1, ge=1, le=5)
    """Number of NATS servers that store the key-value bucket when it is created: 1, or 3 or 5 in a cluster."""
    upload_bytes: int = 64 << 20
    """Maximum size of an upload."""
    upload_seconds: float = 60.0
    """Time limit for parsing, analysing and encoding one upload."""

    secret: SecretStr = SecretStr("")
    """Key that signs tokens, equal on all replicas; empty: no access control."""
    secret_before: SecretStr = SecretStr("")
    """Previous secret, whose tokens stay valid during a rotation."""
    published: str = ""
    """Public address of the port if it differs from the listening address, as in a container."""
    origins: str = ""
    """Origins that may use the server from other pages, `https://dance.example`, separated by commas.

    `null` stands for pages from files and sandboxed frames of any site; it requires a secret.
    """
    trusted_proxies: str = ""
    """Addresses and networks of reverse proxies whose `X-Forwarded-For` names the client, separated by commas or
    spaces; `*` stands for whoever connects directly."""
    connects: float = 50.0
    """WebSocket connections that one address may open per second, with bursts of ten times as many; 0: unlimited."""
    body_seconds: float = 30.0
    """Time window of request bodies: in each, a body must end or bring 500 bytes per second."""
    quota_motions: int = 500
    """Maximum number of motions of one subject; 0: unlimited. Effective with a secret."""
    quota_bytes: int = 1 << 30
    """Maximum bytes of motions of one subject; 0: unlimited. Effective with a secret."""
    quota_sessions: int = 50
    """Maximum number of open sessions of one subject at all replicas; 0: unlimited. Effective with a secret."""
    total_motions: int = 0
    """Maximum number of motions of all subjects; 0: unlimited."""
    total_bytes: int = 0
    """Maximum bytes of motions of all subjects; 0: unlimited."""
    quota_props: int = 100
    """Maximum number of props of one subject; 0: unlimited. Effective with a secret."""
    total_props: int = 1_000
    """Maximum number of props of all subjects; 0: unlimited."""
    quota_links: int = 200
    """Maximum number of links of one subject that have not expired; 0: unlimited."""

    metrics: str = ""
    """`host:port` of a listener that serves only `/metrics`; empty: none."""
    logs: Literal["plain", "json"] = "plain"
    """Format of the log."""
    log_level: Literal["", "debug", "info", "warning", "error"] = ""
    """Minimum level of log messages; empty: INFO for JSON, else WARNING."""

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,  # noqa: ARG003
        file_secret_settings: PydanticBaseSettingsSource,  # noqa: ARG003
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        folder = os.environ.get(SECRETS_VARIABLE)
        if not folder:
            return init_settings, env_settings
        if not Path(folder).is_dir():
            raise ValueError(f"{SECRETS_VARIABLE} is {folder}, which is not a folder")
        # a file wins over a variable, which Compose may have set to the empty string
        return init_settings, SecretsSettingsSource(settings_cls, folder), env_settings

    @field_validator("metrics")
    @classmethod
    def _validate_metrics_address(cls, address: str) -> str:
        if address:
            metrics.parse_address(address)
        return address

    @field_validator("logs", "log_level", mode="before")
    @classmethod
    def _normalise_choice(cls, value: object, info: ValidationInfo) -> object:
        # Compose sets variables without a value to the empty string: use the default
        return (value.lower() or cls.model_fields[info.field_name or ""].default) if isinstance(value, str) else value

    @field_validator("secret", "secret_before")
    @classmethod
    def _validate_secret_length(cls, secret: SecretStr) -> SecretStr:
        if secret.get_secret_value():
            TokenSigner(secret.get_secret_value())
        return secret

    @field_validator("bus")
    @classmethod
    def _validate_bus(cls, url: str) -> str:
        if url != MEMORY_BUS:
            parse_servers(url)
        return url

    @field_validator("catalogue")
    @classmethod
    def _validate_catalogue(cls, url: str) -> str:
        if url:
            Catalogue(url)
        return url

    @field_validator("trusted_proxies")
    @classmethod
    def _validate_trusted_proxies(cls, proxies: str) -> str:
        TrustedProxies.parse(proxies)
        return proxies

    @field_validator("origins")
    @classmethod
    def _validate_origins(cls, origins: str, info: ValidationInfo) -> str:
        secret = info.data.get("secret")
        if OPAQUE_ORIGIN in parse_origins(origins) and not (secret and secret.get_secret_value()):
            raise ValueError("the origin null admits frames of any site: set BUNRAKU_SECRET, or remove null")
        return origins

    def quota(self) -> Quota:
        """Return the limits on stored motions; those per subject apply only with a secret, as subjects need tokens."""
        per_subject = (self.quota_motions, self.quota_bytes) if self.secret.get_secret_value() else (0, 0)
        return Quota(*per_subject, self.total_motions, self.total_bytes)

    def prop_quota(self) -> PropQuota:
        """Return the limits on stored props; those per subject apply only with a secret, as subjects need tokens."""
        return PropQuota(self.quota_props if self.secret.get_secret_value() else 0, self.total_props)

    def session_quota(self) -> int:
        """Return the limit on open sessions of one subject, 0 without a secret, as subjects need tokens."""
        return self.quota_sessions if self.secret.get_secret_value() else 0

    def catalogue_url(self) -> str:
        """Return the URL of the catalogue, or its default."""
        return self.catalogue or f"sqlite:///{self.data.resolve() / 'catalogue.sqlite'}"

    def library_url(self) -> str:
        """Return the URL of the object store, or its default."""
        return self.library or f"file://{self.data.resolve() / 'library'}"
