"""The compressed copies of the built page are those of its files, and gzip is smaller than with zlib."""

import gzip
import runpy
from pathlib import Path

import brotli

REPOSITORY = Path(__file__).parents[1]
PAGE = REPOSITORY / "services" / "bunraku" / "page"
MODULE = runpy.run_path(str(REPOSITORY / "services" / "web" / "compress_page.py"))


def test_copies_have_the_content_of_their_files(tmp_path: Path) -> None:
    script = b"export const limb = 1;\n" * 2000
    large = bytes(range(256)) * (MODULE["MAX_ZOPFLI_BYTES"] // 256 + 1)
    (tmp_path / "assets").mkdir()
    for name, content in {
        "assets/main.js": script,
        "model.data": large,
        "small.js": b"1",
        "font.woff2": script,
    }.items():
        (tmp_path / name).write_bytes(content)
    MODULE["compress_page"](tmp_path)
    names = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.suffix in (".br", ".gz")}
    assert names == {"assets/main.js.br", "assets/main.js.gz", "model.data.br", "model.data.gz"}
    for name in names:
        path = tmp_path / name
        decompress = brotli.decompress if path.suffix == ".br" else gzip.decompress
        assert decompress(path.read_bytes()) == path.with_suffix("").read_bytes()


def test_scripts_of_the_page_are_smaller_than_with_zlib() -> None:
    scripts = [path for path in (PAGE / "assets").glob("*.js") if path.stat().st_size >= MODULE["MIN_BYTES"]]
    zipped = sum(path.with_name(path.name + ".gz").stat().st_size for path in scripts)
    assert 0 < zipped < 0.98 * sum(len(gzip.compress(path.read_bytes(), 9)) for path in scripts)
