/**
 * How the page does in real Chromium over the real server: `make bench-page`, or `make bench-page ARGUMENTS="--only memory
 * --minutes 3"`. It prints a table with the bound of each figure, and as its last line one JSON object.
 *
 *     arrival  `first_paint_s`: from the navigation's beginning until the graphics are done with the first frame that has the
 *              puppet in it, asked of a fence behind its commands; the median of five browsers started for it, with nothing cached. `js_gzip_kb`
 *              and `fonts_kb`: all scripts and fonts that came until a hand had been taken
 *     line     `first_paint_1mbit_s`: the same on a line of 1 Mbit/s and 100 ms, emulated by Chromium itself, sockets too
 *     frames   `frame_ms_p95`: what one call of the page's animation frame takes of the main thread, slowed down four times,
 *              with three limbs pulled and at full quality; of frames that drew. It is the thread's own time out
 *              of Chromium's trace, so that waiting for a processor that others have does not count; what draws the picture is
 *              another process, and Chromium's layout and painting after it are not the page's
 *     drawing  `draw_calls` and `triangles` of a frame at full quality, by night, three limbs held: shadows and mirror too
 *     memory   `heap_growth_mb`: of the script's heap after garbage was collected, over `--minutes` (30) of playing, pulling,
 *              uploading and opening everything, after a warm-up of the same; nodes and listeners beside it. Of it
 *              `heap_growth_objects_mb` is what the page made and holds, `heap_growth_code_mb` what V8 makes of the script,
 *              ever better as it runs
 *     audio    `audio_ms_p95`: what is heard against what is shown, the worst of its lines (`make bench-audio`)
 *     axe      `axe_violations`: axe-core's, in both themes with every panel open, on a desktop and on a phone
 *
 * Where there is no graphics processor the picture is drawn in software, which takes most of a first paint.
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

/** What each figure may be at most. */
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
if (unknown.length > 0) throw new Error(`there is no case ${unknown.join()}; there are ${Object.keys(CASES).join()}`);
const minutes = Number(values.minutes);
if (!(minutes > 0)) throw new Error(`--minutes ${values.minutes} is no time to play`);
const place = chromiumPath();
if (!place) throw new Error("Chromium is not installed; its place may be given in CHROMIUM");

const figures: BenchFigures = {};
const notes: string[] = [];
const server = await startServer({ demo: true });
try {
  const bench: BenchContext = { url: server.url, chromium: place, minutes, note: (text) => void notes.push(text) };
  for (const name of only) Object.assign(figures, await CASES[name](bench));
} finally {
  await server.stop();
}
for (const [name, value] of Object.entries(figures)) {
  const bound = BOUNDS[name];
  const judged = bound === undefined ? "" : `at most ${bound}${value <= bound ? "" : "  MISSED"}`;
  console.log(`${name.padEnd(22)}${String(value).padStart(10)}  ${judged}`.trimEnd());
}
for (const note of notes) console.log(`  ${note}`);
console.log(JSON.stringify({ bench: "page", ...figures }));
