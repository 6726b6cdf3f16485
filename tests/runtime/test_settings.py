from __future__ import annotations

import re
from pathlib import Path

import pytest
from pydantic import ValidationError

from bunraku.cli_access import describe_setting_error
from bunraku.runtime.settings import Settings
from tests.conftest import REPOSITORY


def test_defaults_are_in_the_data_folder_and_the_environment_overrides(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = Settings(data=tmp_path)
    assert settings.catalogue_url() == f"sqlite:///{tmp_path}/catalogue.sqlite"
    assert settings.library_url() == f"file://{tmp_path}/library"
    monkeypatch.setenv("BUNRAKU_LIBRARY", "s3://bucket/motions")
    assert Settings(data=tmp_path).library_url() == "s3://bucket/motions"


def test_each_is_in_the_documentation_with_its_default() -> None:
    rows = re.findall(
        r"^\| (`BUNRAKU_.*?) \| (.*?) \|", (REPOSITORY / "docs" / "settings.md").read_text(), re.MULTILINE
    )
    said: dict[str, str] = {}
    for names, defaults in rows:
        variables = re.findall(r"`(BUNRAKU_\w+)`", names)
        values = [defaults.strip("`")] if len(variables) == 1 else defaults.split(", ")
        said.update(zip(variables, values, strict=True))
    fields = {f"BUNRAKU_{name.upper()}": field.default for name, field in Settings.model_fields.items()}
    assert set(said) == set(fields)
    for variable, default in fields.items():
        if isinstance(default, int | float):
            assert float(said[variable]) == default, variable
        elif str(default):
            assert said[variable] == str(default), variable


def test_as_many_servers_keep_the_register_as_can_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    assert Settings().register_replicas == 1
    monkeypatch.setenv("BUNRAKU_REGISTER_REPLICAS", "3")
    assert Settings().register_replicas == 3
    # JetStream has five at most
    for wrong in ("0", "6"):
        monkeypatch.setenv("BUNRAKU_REGISTER_REPLICAS", wrong)
        with pytest.raises(ValidationError):
            Settings()


def test_what_is_told_of_a_process_is_set_by_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = Settings(data=tmp_path)
    assert (settings.metrics, settings.logs, settings.log_level) == ("", "plain", "")
    # as compose sets what is not given
    for name in ("METRICS", "LOGS", "LOG_LEVEL"):
        monkeypatch.setenv(f"BUNRAKU_{name}", "")
    settings = Settings(data=tmp_path)
    assert (settings.metrics, settings.logs, settings.log_level) == ("", "plain", "")
    for name, value in {"METRICS": "[::1]:9100", "LOGS": "JSON", "LOG_LEVEL": "Debug"}.items():
        monkeypatch.setenv(f"BUNRAKU_{name}", value)
    settings = Settings(data=tmp_path)
    assert (settings.metrics, settings.logs, settings.log_level) == ("[::1]:9100", "json", "debug")


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("METRICS", "9100", "metrics are at host:port, 127.0.0.1:9100 say"),
        ("LOGS", "xml", "'plain' or 'json'"),
        ("LOG_LEVEL", "loud", "'warning' or 'error'"),
    ],
)
def test_what_is_no_such_word_is_refused_with_what_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, value: str, says: str
) -> None:
    monkeypatch.setenv(f"BUNRAKU_{name}", value)
    with pytest.raises(ValueError, match=says) as refused:
        Settings(data=tmp_path)
    assert name in describe_setting_error(refused.value)
