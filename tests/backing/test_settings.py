from __future__ import annotations

from pathlib import Path

import pytest

from bunraku.backing.settings import Settings


def test_defaults_are_in_the_data_folder_and_the_environment_overrides(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = Settings(data=tmp_path)
    assert settings.catalogue_url() == f"sqlite:///{tmp_path}/catalogue.sqlite"
    assert settings.library_url() == f"file://{tmp_path}/library"
    monkeypatch.setenv("BUNRAKU_LIBRARY", "s3://bucket/motions")
    assert Settings(data=tmp_path).library_url() == "s3://bucket/motions"
