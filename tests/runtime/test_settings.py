from __future__ import annotations

import re
from pathlib import Path

import pytest
from pydantic import ValidationError

from bunraku.cli_access import describe_setting_error
from bunraku.runtime.settings import Settings
from tests.conftest import REPOSITORY


def test_defaults_lie_in_the_data_folder_and_environment_overrides(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = Settings(data=tmp_path)
    assert settings.catalogue_url() == f"sqlite:///{tmp_path}/catalogue.sqlite"
    assert settings.library_url() == f"file://{tmp_path}/library"
    monkeypatch.setenv("BUNRAKU_LIBRARY", "s3://bucket/motions")
    assert Settings(data=tmp_path).library_url() == "s3://bucket/motions"


def test_each_setting_is_documented_with_its_default() -> None:
    rows = re.findall(
        r"^\| (`BUNRAKU_.*?) \| (.*?) \|", (REPOSITORY / "docs" / "operations.md").read_text(), re.MULTILINE
    )
    documented: dict[str, str] = {}
    for names, defaults in rows:
        variables = re.findall(r"`(BUNRAKU_\w+)`", names)
        values = [defaults.strip("`")] if len(variables) == 1 else defaults.split(", ")
        documented.update(zip(variables, values, strict=True))
    fields = {f"BUNRAKU_{name.upper()}": field.default for name, field in Settings.model_fields.items()}
    assert set(documented) == set(fields)
    for variable, default in fields.items():
        if isinstance(default, int | float):
            assert float(documented[variable]) == default, variable
        elif str(default):
            assert documented[variable] == str(default), variable


def test_register_replicas_are_limited_to_five(monkeypatch: pytest.MonkeyPatch) -> None:
    assert Settings().register_replicas == 1
    monkeypatch.setenv("BUNRAKU_REGISTER_REPLICAS", "3")
    assert Settings().register_replicas == 3
    # the limit of JetStream
    for invalid in ("0", "6"):
        monkeypatch.setenv("BUNRAKU_REGISTER_REPLICAS", invalid)
        with pytest.raises(ValidationError):
            Settings()


def test_log_and_metrics_settings_ignore_case_and_empty_values(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = Settings(data=tmp_path)
    assert (settings.metrics, settings.logs, settings.log_level) == ("", "plain", "")
    # Compose sets variables without a value to the empty string
    for name in ("METRICS", "LOGS", "LOG_LEVEL"):
        monkeypatch.setenv(f"BUNRAKU_{name}", "")
    settings = Settings(data=tmp_path)
    assert (settings.metrics, settings.logs, settings.log_level) == ("", "plain", "")
    for name, value in {"METRICS": "[::1]:9100", "LOGS": "JSON", "LOG_LEVEL": "Debug"}.items():
        monkeypatch.setenv(f"BUNRAKU_{name}", value)
    settings = Settings(data=tmp_path)
    assert (settings.metrics, settings.logs, settings.log_level) == ("[::1]:9100", "json", "debug")


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("METRICS", "9100", "expected host:port, for example 127.0.0.1:9100"),
        ("LOGS", "xml", "'plain' or 'json'"),
        ("LOG_LEVEL", "loud", "'warning' or 'error'"),
    ],
)
def test_invalid_value_is_rejected_with_the_valid_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, value: str, message: str
) -> None:
    monkeypatch.setenv(f"BUNRAKU_{name}", value)
    with pytest.raises(ValueError, match=message) as raised:
        Settings(data=tmp_path)
    assert name in describe_setting_error(raised.value)


@pytest.mark.parametrize(
    "setting",
    [
        {"bus": "tls://me:password@a,nats://b"},
        {"bus": "nats://me:password@a?ca=/ca.crt"},
        {"catalogue": "postgres://me:password@a/b"},
        {"catalogue": "postgresql://me:password@a/b?sslmode=verify"},
    ],
)
def test_invalid_address_is_rejected_without_its_password(setting: dict[str, str]) -> None:
    with pytest.raises(ValidationError, match=r"invalid (bus address|catalogue URL)") as raised:
        Settings.model_validate(setting)
    assert "password" not in str(raised.value) + describe_setting_error(raised.value)


def test_secrets_are_read_from_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BUNRAKU_SECRETS", str(tmp_path))
    monkeypatch.setenv("BUNRAKU_SECRET", "")
    monkeypatch.setenv("BUNRAKU_UPLOAD_BYTES", "5")
    (tmp_path / "BUNRAKU_SECRET").write_text("a secret in a file, long enough for a key\n")
    (tmp_path / "bunraku_catalogue").write_text("postgresql://me:word@a/b")
    (tmp_path / "unrelated").write_text("1")
    settings = Settings(data=tmp_path)
    assert settings.secret.get_secret_value() == "a secret in a file, long enough for a key"
    assert settings.catalogue == "postgresql://me:word@a/b"
    assert settings.upload_bytes == 5
    monkeypatch.setenv("BUNRAKU_SECRETS", str(tmp_path / "none"))
    with pytest.raises(ValueError, match="none, which is not a folder"):
        Settings()
