/**
 * Benchmark of the page in Chromium against a running server: `make bench-page`, or `make bench-page ARGUMENTS="--only
 * memory --minutes 3"`. It prints a table of figures with their bounds, and a JSON object as its last line. Cases:
 *
 * - `arrival`: `first_paint_s` is the time from the start of the navigation until the GPU has completed the first frame
 *   with the puppet; median of five newly started browsers with empty caches. `js_gzip_kb` and `fonts_kb` are all
 *   scripts and fonts loaded until a hand is held.
 * - `line`: `first_paint_1mbit_s` is the same at 1 Mbit/s and 100 ms RTT, emulated by Chromium, WebSockets included.
 * - `frames`: cost of a frame with 4x CPU slowdown, full quality and three controlled limbs. All figures are thread
 *   time
 *   from Chromium's trace, which excludes waits for a processor and the GPU process. If the stage is drawn in a worker,
 *   `main_ms_p95` is the time of the page's animation frame callbacks and of messages from one of its animation frames to
 *   the next, without layout and painting, which are in a note, and `worker_ms_p95` is the worker's time for an animation frame callback that draws. Chromium
 *   slows only the main thread, so the worker's time is the measured one times 4. If the stage is drawn in the page,
 *   `main_ms_p95` is the time for an animation frame callback that draws, without layout and painting.
 * - `pointer`: `pointer_ms_p95` is the time from a movement of the mouse that drags a hand (the time stamp of its
 *   event, also if the browser combines it with a later one) to the end of the first frame that shows it, without
 *   slowdown. It excludes the GPU process.
 * - `drawing`: `draw_calls` and `triangles` of a frame at full quality in the dark theme with three held limbs, shadow
 *   and mirror passes included.
 * - `software`: `software_fps` and `software_resolution` are the frames per second and the resolution that the stage
 *   settles at in a window of 1440 x 900, in the dark theme, without a graphics processor. `software_ssim` is the
 *   smallest structural similarity of three such frames to the picture in full quality, over the first performer.
 * - `memory`: `heap_growth_mb` is the growth of the script heap after a garbage collection, over `--minutes` (30) of
 *   playing, controlling, uploading and opening panels, after a warm-up. `heap_growth_objects_mb` is its share of
 *   objects, `heap_growth_code_mb` that of V8's compiled code. The growth of DOM nodes and listeners is reported too.
 * - `audio`: `audio_ms_p95` is the time difference of sound and stage in the worst tested condition
 *   (`make bench-audio`).
 * - `axe`: `axe_violations` is the number of axe-core's findings in both themes with each panel open, on a desktop and
 *   on a phone.
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
import { benchPointer } from "./page/pointer";
import { benchSoftwareRendering } from "./page/software";

const CASES: Readonly<Record<string, (bench: BenchContext) => Promise<BenchFigures>>> = {
  arrival: benchFirstPaint,
  line: benchConstrainedFirstPaint,
  frames: benchFrameTime,
  pointer: benchPointer,
  drawing: benchDrawCalls,
  software: benchSoftwareRendering,
  memory: benchMemory,
  audio: benchAudioSync,
  axe: benchAccessibility,
};

/** Upper bounds of the figures. */
const BOUNDS: Readonly<Record<string, number>> = {
  first_paint_s: 1,
  js_gzip_kb: 235,
  fonts_kb: 60,
  first_paint_1mbit_s: 3.5,
  main_ms_p95: 4,
  worker_ms_p95: 12,
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
