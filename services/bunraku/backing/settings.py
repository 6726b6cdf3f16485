"""Where the services find what they stand on: environment variables `BUNRAKU_...`, or defaults for one machine.

docs/settings.md says it for people.
"""

from __future__ import annotations

from pathlib import Path

from pydantic_settings import BaseSettings, SettingsConfigDict


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
    upload_bytes: int = 64 << 20
    """The largest upload."""
    upload_seconds: float = 60.0
    """The longest that reading, analysing and encoding one upload may take."""

    def catalogue_url(self) -> str:
        """The catalogue's URL, the default filled in."""
        return self.catalogue or f"sqlite:///{self.data.resolve() / 'catalogue.sqlite'}"

    def library_url(self) -> str:
        """The library's URL, the default filled in."""
        return self.library or f"file://{self.data.resolve() / 'library'}"
