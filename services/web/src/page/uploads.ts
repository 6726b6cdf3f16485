/** Sends files one after another, with true progress, and tells problems in the server's own plain words. */
import { uploadMotion, type Motion } from "../client/library";
import { ProblemError } from "../client/problem";
import type { Library } from "./library";
import { say } from "../words/say";

/** Uploads `files` in turn; `done` gets each motion as it is stored. */
export async function uploadAll(files: readonly File[], library: Library, done: (motion: Motion) => Promise<void>): Promise<void> {
  const waiting = files.map((file) => {
    const abort = new AbortController();
    return { file, abort, row: library.upload(file.name, () => abort.abort()) };
  });
  for (const { file, abort, row } of waiting) {
    const started = performance.now();
    try {
      const motion = await uploadMotion(file, ({ stage, share }) => {
        if (stage === "sending") row.sending(share * file.size, file.size, (performance.now() - started) / 1000);
        else row.making(stage, share);
      }, abort.signal);
      row.remove();
      await done(motion);
    } catch (error) {
      row.remove();
      if (!abort.signal.aborted) tell(library, file.name, error);
    }
  }
}

/** Shows what went wrong with something named `name`. */
export function tell(library: Pick<Library, "problem">, name: string, error: unknown): void {
  if (!(error instanceof ProblemError)) throw error;
  const { title, detail, line, hint } = error;
  library.problem(name, title, line === null ? detail : say("{detail} (line {line})", { detail, line }), hint);
}
