/** Upload of motion files, one after another, with progress and errors in the library panel. */
import { type Motion, uploadMotion } from "../../client/api";
import { ProblemError } from "../../client/problem";
import { translate } from "../../i18n/translator";
import type { LibraryPanel } from "./library-panel";

/** Upload `files` in order. `onStored` is called with each motion once it is stored. */
export async function uploadAll(
  files: readonly File[],
  library: LibraryPanel,
  onStored: (motion: Motion) => Promise<void>,
): Promise<void> {
  const uploads = files.map((file) => {
    const abort = new AbortController();
    return { file, abort, row: library.addUpload(file.name, () => abort.abort()) };
  });
  for (const { file, abort, row } of uploads) {
    const startMs = performance.now();
    try {
      const motion = await uploadMotion(
        file,
        ({ stage, share }) => {
          if (stage === "sending") row.showSent(share * file.size, file.size, (performance.now() - startMs) / 1000);
          else row.showIngest(stage, share);
        },
        abort.signal,
      );
      row.remove();
      await onStored(motion);
    } catch (error) {
      row.remove();
      if (!abort.signal.aborted) showProblem(library, file.name, error);
    }
  }
}

/** Show a ProblemError about the file or motion `name` in the library. Throws any other error. */
export function showProblem(library: Pick<LibraryPanel, "problem">, name: string, error: unknown): void {
  if (!(error instanceof ProblemError)) throw error;
  const { title, detail, line, hint } = error;
  library.problem(name, title, line === null ? detail : translate("{detail} (line {line})", { detail, line }), hint);
}
