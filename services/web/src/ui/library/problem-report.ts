/** Report of failed requests in the library panel. */
import { ProblemError } from "../../client/problem";
import { translate } from "../../i18n/translator";
import type { LibraryPanel } from "./library-panel";

/** Show a ProblemError about the file or motion `name` in the library. Throws any other error. */
export function showProblem(library: Pick<LibraryPanel, "problem">, name: string, error: unknown): void {
  if (!(error instanceof ProblemError)) throw error;
  const { title, detail, line, hint } = error;
  library.problem(name, title, line === null ? detail : translate("{detail} (line {line})", { detail, line }), hint);
}
