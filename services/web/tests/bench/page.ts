/**
 * Benchmark of the page in Chromium against a running server: `make bench-page`, or `make bench-page ARGUMENTS="--only
 * memory --minutes 3"`. It prints a table of figures with their bounds, and a JSON object as its last line.
 *
 * | case      | figures | |-----------|---------| | `arrival` | `first_paint_s`: from the start of the navigation until
 * a GPU fence after the first frame with the puppet is | |           | signalled. Median of five freshly started
 * browsers with empty caches. `js_gzip_kb`, `fonts_kb`: scripts and | |           | fonts loaded until a hand is held |
 * | `line`    | `first_paint_1mbit_s`: the same with 1 Mbit/s and 100 ms, emulated by Chromium, for WebSockets too | |
 * `frames`  | `frame_ms_p95`: main thread time of an animation frame callback that draws, at 4x CPU slowdown, full
 * quality | |           | and three controlled limbs. It is thread time of Chromium's trace: waits for a processor, the
 * GPU process and | |           | Chromium's own layout and painting are not included | | `drawing` | `draw_calls`,
 * `triangles` per frame, shadows and mirror included: full quality, dark theme, three held limbs | | `memory`  |
 * `heap_growth_mb`: growth of the script heap after a garbage collection, over `--minutes` (30) of playing, | |
 * | controlling, uploading and opening panels, after a warm-up. `heap_growth_objects_mb` are objects of the page, | |
 * | `heap_growth_code_mb` V8's compiled code. Growth of nodes and listeners | | `audio`   | `audio_ms_p95`: time
 * difference of sound and stage, worst of the tested conditions (`make bench-audio`) | | `axe`     | `axe_violations`:
 * axe-core's findings in both themes with each panel open, on a desktop and on a phone |
 *
 * Without a graphics processor Chromium renders in software, which takes most of the first paint time.
 */
import { parseArgs } from "node:util";
import { chromiumPath } from "../browser/chromium";
import { startServer } from "../browser/server";
import { benchAccessibility } from "./page/accessibility";
import { benchAudioSync } from "./page/audio-sync";
import type { BenchContext, BenchFigures } from "./page/bench";
import { benchConstrainedFirstPaint, benchFirstPaint } from "./page/first-paint";
import { benchDrawCalls, benchFrameTime } from "./page/frame-cost";
import { benchMemory } from "./page/memory";

const CASES: Readonly<Record<string, (bench: BenchContext) => Promise<BenchFigures>>> = {
  arrival: benchFirstPaint,
  line: benchConstrainedFirstPaint,
  frames: benchFrameTime,
  drawing: benchDrawCalls,
  memory: benchMemory,
  audio: benchAudioSync,
  axe: benchAccessibility,
};

/** Upper bounds of the figures. */
const BOUNDS: Readonly<Record<string, number>> = {
  first_paint_s: 1,
  js_gzip_kb: 260,
  fonts_kb: 60,
  first_paint_1mbit_s: 3.5,
  frame_ms_p95: 6,
  draw_calls: 12,
  triangles: 80_000,
  heap_growth_mb: 5,
  audio_ms_p95: 20,
  axe_violations: 0,
};

const { values } = parseArgs({
  options: { only: { type: "string", default: Object.keys(CASES).join() }, minutes: { type: "string", default: "30" } },
});
const only = values.only.split(",");
const unknown = only.filter((name) => !(name in CASES));
if (unknown.length > 0)
  throw new Error(`Unknown case in --only: ${unknown.join()}. Cases: ${Object.keys(CASES).join()}`);
const minutes = Number(values.minutes);
if (!(minutes > 0)) throw new Error(`Invalid --minutes ${values.minutes}: expected a positive number`);
const chromium = chromiumPath();
if (!chromium) throw new Error("Chromium not found. Install it, or set CHROMIUM to its path");

const figures: BenchFigures = {};
const notes: string[] = [];
const server = await startServer({ demo: true });
try {
  const bench: BenchContext = { url: server.url, chromium, minutes, note: (text) => void notes.push(text) };
  for (const name of only) Object.assign(figures, await CASES[name](bench));
} finally {
  await server.stop();
}
for (const [name, value] of Object.entries(figures)) {
  const bound = BOUNDS[name];
  const verdict = bound === undefined ? "" : `at most ${bound}${value <= bound ? "" : "  MISSED"}`;
  console.log(`${name.padEnd(22)}${String(value).padStart(10)}  ${verdict}`.trimEnd());
}
for (const note of notes) console.log(`  ${note}`);
console.log(JSON.stringify({ bench: "page", ...figures }));
