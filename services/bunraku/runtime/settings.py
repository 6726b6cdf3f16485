"""Where the services find what they stand on: environment variables `BUNRAKU_...`, or defaults for one machine.

docs/settings.md says it for people.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field, SecretStr, ValidationInfo, field_validator
from pydantic_settings import BaseSettings, SettingsConfigDict

from bunraku.http.access_token import TokenSigner
from bunraku.http.origin import OPAQUE_ORIGIN, parse_origins
from bunraku.runtime import metrics
from bunraku.storage.catalogue import Quota


class Settings(BaseSettings):
    """Addresses and limits of one process."""

    model_config = SettingsConfigDict(env_prefix="BUNRAKU_")

    data: Path = Path(".bunraku")
    """Folder of the embedded defaults."""
    catalogue: str = ""
    """URL of the catalogue, `sqlite:///...` or `postgresql://...`; empty: SQLite in `data`."""
    library: str = ""
    """URL of the library, `file:///...`, `s3://...` and what else obstore knows; empty: a folder in `data`."""
    bus: str = "memory:"
    """URL of the bus, `memory:` for one process or `nats://...`, more servers after commas."""
    register_replicas: int = Field(default=1, ge=1, le=5)
    """Servers of the bus that each keep the register, when it is made: 1, or 3 or 5 of a cluster."""
    upload_bytes: int = 64 << 20
    """The largest upload."""
    upload_seconds: float = 60.0
    """The longest that reading, analysing and encoding one upload may take."""

    secret: SecretStr = SecretStr("")
    """What tokens are signed with, the same at all replicas; empty: everybody may do everything."""
    secret_before: SecretStr = SecretStr("")
    """A secret whose tokens are still good, while the secret is changed."""
    published: str = ""
    """The address at which people reach the port, where that is not the one listened at: a container's."""
    origins: str = ""
    """Pages elsewhere that may read answers, open sockets and change things, `https://dance.example`, more after
    commas; `null`: pages from files, and frames in a sandbox, of whatever site: only with a secret."""
    connects: float = 50.0
    """Sockets that one address may open in a second, ten times as many at once; 0: any number."""
    body_seconds: float = 30.0
    """The longest that the body of a request may take, beside a second for each 1,000 bytes of it."""
    quota_motions: int = 500
    """Motions that one subject may keep; 0: any number. Where there is a secret."""
    quota_bytes: int = 1 << 30
    """Bytes of motions that one subject may keep; 0: any number. Where there is a secret."""
    total_motions: int = 0
    """Motions that all may keep; 0: any number."""
    total_bytes: int = 0
    """Bytes of motions that all may keep; 0: any number."""

    metrics: str = ""
    """`host:port` of a listener that answers `/metrics` and nothing else; empty: none."""
    logs: Literal["plain", "json"] = "plain"
    """How the log is written."""
    log_level: Literal["", "debug", "info", "warning", "error"] = ""
    """From which level on; empty: INFO where it is JSON, else WARNING."""

    @field_validator("metrics")
    @classmethod
    def _validate_metrics_address(cls, address: str) -> str:
        if address:
            metrics.parse_address(address)
        return address

    @field_validator("logs", "log_level", mode="before")
    @classmethod
    def _normalise_choice(cls, value: object, info: ValidationInfo) -> object:
        # what is set and empty, as compose sets it, is as if it were not
        return (value.lower() or cls.model_fields[info.field_name or ""].default) if isinstance(value, str) else value

    @field_validator("secret", "secret_before")
    @classmethod
    def _validate_secret_length(cls, secret: SecretStr) -> SecretStr:
        if secret.get_secret_value():
            TokenSigner(secret.get_secret_value())
        return secret

    @field_validator("origins")
    @classmethod
    def _validate_origins(cls, origins: str, info: ValidationInfo) -> str:
        secret = info.data.get("secret")
        if OPAQUE_ORIGIN in parse_origins(origins) and not (secret and secret.get_secret_value()):
            raise ValueError("null lets in frames of whatever site, so that it takes a secret to tell who comes")
        return origins

    def quota(self) -> Quota:
        """How much may be kept; of one subject there is a limit only where subjects are known."""
        one = (self.quota_motions, self.quota_bytes) if self.secret.get_secret_value() else (0, 0)
        return Quota(*one, self.total_motions, self.total_bytes)

    def catalogue_url(self) -> str:
        """The catalogue's URL, the default filled in."""
        return self.catalogue or f"sqlite:///{self.data.resolve() / 'catalogue.sqlite'}"

    def library_url(self) -> str:
        """The library's URL, the default filled in."""
        return self.library or f"file://{self.data.resolve() / 'library'}"
