/** Case `audio`: time difference of sound and stage, measured by `tests/browser/audio.test.ts`. */
import { execFileSync } from "node:child_process";
import { resolve } from "node:path";
import type { BenchContext, BenchFigures } from "./bench";

export function benchAudioSync({ note }: BenchContext): Promise<BenchFigures> {
  const web = resolve(import.meta.dirname, "../../..");
  const output = execFileSync(
    "npx",
    ["vitest", "run", "tests/browser/audio.test.ts", "-t", "clicks are heard in time with the stage"],
    {
      cwd: web,
      env: { ...process.env, BUNRAKU_BENCH: "1" },
      encoding: "utf8",
      maxBuffer: 1 << 24,
    },
  );
  const results = [...output.matchAll(/\{"bench":"audio".*\}/g)].map(
    ([json]) => JSON.parse(json) as { line: string; audio_p95_ms: number },
  );
  if (results.length === 0) throw new Error(`The audio test printed no results. Output:\n${output}`);
  for (const { line, audio_p95_ms } of results) note(`audio: ${line} ${audio_p95_ms} ms`);
  return Promise.resolve({ audio_ms_p95: Math.max(...results.map(({ audio_p95_ms }) => audio_p95_ms)) });
}
