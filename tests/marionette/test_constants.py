"""The constants of `proto/constants.json` are defined once per language."""

from __future__ import annotations

import json
import re
from math import degrees
from pathlib import Path

import pytest

from bunraku.marionette import constants

ROOT = Path(__file__).parents[2]
VALUES = json.loads((ROOT / "proto" / "constants.json").read_text(encoding="utf-8"))
PYTHON_MODULE = ROOT / "services" / "bunraku" / "marionette" / "constants.py"
TYPESCRIPT_MODULE = ROOT / "services" / "web" / "src" / "marionette" / "constants.ts"
UNITS = re.compile(
    r"_(deg|rad|s|us|arm_lengths|xyz|ratio|ratios|factor|weight|weight_per_arm_length|cosine|side|caps"
    r"|arm_lengths_or_rad|(deg|rad|arm_lengths|arm_lengths_or_rad)_per_s2?)$"
)


def test_every_key_ends_with_its_unit() -> None:
    keys = [*VALUES, *(key for cap in VALUES["left_shoulder_caps"] for key in cap)]
    assert [key for key in keys if not UNITS.search(key)] == []


@pytest.mark.parametrize("module", [PYTHON_MODULE, TYPESCRIPT_MODULE], ids=["Python", "TypeScript"])
def test_every_constant_is_read(module: Path) -> None:
    source = module.read_text(encoding="utf-8")
    assert [key for key in VALUES if not re.search(rf"\b{key}\b", source)] == []


def test_python_and_typescript_export_the_same_names() -> None:
    python = set(re.findall(r"^([A-Z]\w+)(?:: [^=\n]+)? = ", PYTHON_MODULE.read_text(encoding="utf-8"), re.M))
    typescript = set(re.findall(r"^export const ([A-Z]\w+)", TYPESCRIPT_MODULE.read_text(encoding="utf-8"), re.M))
    assert python - {"CONSTANTS"} == typescript - {"MAX_WRIST_BEND_DEG"}


def test_no_other_module_redefines_a_constant() -> None:
    names = set(re.findall(r"^([A-Z]\w+) = ", PYTHON_MODULE.read_text(encoding="utf-8"), re.M))
    pattern = re.compile(rf"^(?:export )?(?:const )?_?({'|'.join(sorted(names))})(?:: [^=\n]+)? = ", re.M)
    modules = [
        path
        for folder, suffix in (("services/bunraku", "py"), ("services/web/src", "ts"))
        for path in (ROOT / folder).rglob(f"*.{suffix}")
        if path not in (PYTHON_MODULE, TYPESCRIPT_MODULE)
    ]
    assert len(modules) > 200
    redefinitions = {str(path): pattern.findall(path.read_text(encoding="utf-8")) for path in modules}
    assert {path: found for path, found in redefinitions.items() if found} == {}


def test_package_reads_the_contract_file() -> None:
    assert constants.CONSTANTS == VALUES
    assert (PYTHON_MODULE.parent / "constants.json").resolve() == ROOT / "proto" / "constants.json"
    assert degrees(constants.MAX_ELBOW_BEND_RAD) == pytest.approx(VALUES["max_elbow_bend_deg"])
