/**
 * Writes a copy of each file of the built page that is text, a program or a model with Brotli (`.br`) and one with gzip (`.gz`), so that the server
 * compresses nothing: `node compress-page.mjs FOLDER`.
 */
import { readdirSync, readFileSync, statSync, writeFileSync } from "node:fs";
import { extname, join } from "node:path";
import { brotliCompressSync, constants, gzipSync } from "node:zlib";

const EXTENSIONS = new Set([
  ...[".binarypb", ".css", ".data", ".html", ".js", ".json", ".svg", ".txt", ".wasm", ".webmanifest"],
]);
/** Smaller files fit into one packet with their headers. */
const MIN_BYTES = 1000;

const folder = process.argv[2];
for (const name of readdirSync(folder, { recursive: true, encoding: "utf8" })) {
  const path = join(folder, name);
  if (!EXTENSIONS.has(extname(path)) || statSync(path).size < MIN_BYTES) continue;
  const data = readFileSync(path);
  writeFileSync(
    `${path}.br`,
    brotliCompressSync(data, { params: { [constants.BROTLI_PARAM_SIZE_HINT]: data.length } }),
  );
  writeFileSync(`${path}.gz`, gzipSync(data, { level: constants.Z_BEST_COMPRESSION }));
}
