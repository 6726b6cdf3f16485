/** How far what is heard is from what is shown: case `audio`, which the browser's own test measures. */
import { execFileSync } from "node:child_process";
import { resolve } from "node:path";
import type { BenchContext, BenchFigures } from "./bench";

export function benchAudioSync({ note }: BenchContext): Promise<BenchFigures> {
  const web = resolve(import.meta.dirname, "../../..");
  const said = execFileSync(
    "npx",
    ["vitest", "run", "tests/browser/audio.test.ts", "-t", "clicks are heard in time with the stage"],
    {
      cwd: web,
      env: { ...process.env, BUNRAKU_BENCH: "1" },
      encoding: "utf8",
      maxBuffer: 1 << 24,
    },
  );
  const lines = [...said.matchAll(/\{"bench":"audio".*\}/g)].map(
    ([line]) => JSON.parse(line) as { line: string; audio_p95_ms: number },
  );
  if (lines.length === 0) throw new Error(`nothing was measured:\n${said}`);
  for (const { line, audio_p95_ms } of lines) note(`audio: ${line} ${audio_p95_ms} ms`);
  return Promise.resolve({ audio_ms_p95: Math.max(...lines.map(({ audio_p95_ms }) => audio_p95_ms)) });
}
