/** Edited copies of motions, made by the server, with their progress in the library panel. */
import type { Motion } from "../client/api";
import { editMotion, type MotionEdit } from "../client/motion-library";
import { formatIngestStage } from "../ui/format";
import type { LibraryPanel } from "../ui/library/library-panel";
import type { MotionItem } from "../ui/library/motion-item";
import { showProblem } from "../ui/library/problem-report";

/** Create an edited copy. `onStored` is called with it once it is stored. Errors are reported in the library. */
export async function createEditedMotion(
  { id, name }: MotionItem,
  edit: MotionEdit,
  library: Pick<LibraryPanel, "addUpload" | "problem">,
  onStored: (motion: Motion) => Promise<void>,
): Promise<void> {
  const abort = new AbortController();
  const row = library.addUpload(name, () => abort.abort());
  try {
    const motion = await editMotion(
      id,
      edit,
      ({ stage, share }) => row.showProgress(formatIngestStage(stage), share),
      abort.signal,
    );
    row.remove();
    await onStored(motion);
  } catch (error) {
    row.remove();
    if (!abort.signal.aborted) showProblem(library, name, error);
  }
}
