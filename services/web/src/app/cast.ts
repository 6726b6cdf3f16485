/** Adding the performers of another motion to those on the stage. */
import { addPerformers } from "../client/api";
import { translate } from "../i18n/translator";
import type { LibraryPanel } from "../ui/library/library-panel";
import type { MotionItem } from "../ui/library/motion-item";
import type { MotionList } from "../ui/library/motion-list";
import { showProblem } from "../ui/library/problem-report";
import { MAX_PERFORMERS } from "../wire/limbs";
import type { RemotePlayback } from "./remote-playback";

/**
 * Add the performers of `item` to the motion that `playback` shows. The server stores the result as a new motion, which
 * replaces the shown one at the same position. Errors are reported in the library.
 */
export async function addMotionToStage(
  item: MotionItem,
  playback: RemotePlayback,
  motions: MotionList,
  library: Pick<LibraryPanel, "problem">,
): Promise<void> {
  const { motion, performerCount } = playback;
  if (motion === null) return;
  if (performerCount + item.performers > MAX_PERFORMERS) {
    library.problem(
      item.name,
      translate("The stage is full"),
      translate("a stage holds at most {count} dancers", { count: MAX_PERFORMERS }),
      null,
    );
    return;
  }
  try {
    const { id } = await addPerformers(motion, [item.id]);
    // The new motion is played even if the list cannot be fetched now.
    await motions.refresh().catch(() => undefined);
    playback.edit({ motion: id, position: Math.round(playback.position * 1e6) });
  } catch (error) {
    showProblem(library, item.name, error);
  }
}
