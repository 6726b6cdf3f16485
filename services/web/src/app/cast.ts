/** A further dance beside those on the stage: asked of the library, and danced by everyone once it is there. */
import { addPerformers } from "../client/api";
import { translate } from "../i18n/translator";
import type { LibraryPanel, MotionItem } from "../ui/library/library-panel";
import type { MotionList } from "../ui/library/motion-list";
import { showProblem } from "../ui/library/upload";
import { MAX_PERFORMERS } from "../wire/limbs";
import type { Playback } from "./playback";

/** Adds who dances in `piece` to the stage of `room`, where there is room for them. The dance goes on where it is. What is wrong is told in the library. */
export async function addMotionToStage(
  item: MotionItem,
  playback: Playback,
  motions: MotionList,
  library: Pick<LibraryPanel, "problem">,
): Promise<void> {
  const { motion, performers } = playback.viewer;
  if (motion === null) return;
  if (performers.length + item.performers > MAX_PERFORMERS) {
    library.problem(
      item.name,
      translate("There is no more room on the stage"),
      translate("{count} dancers are the most that a stage has", { count: MAX_PERFORMERS }),
      null,
    );
    return;
  }
  try {
    const { id } = await addPerformers(motion, [item.id]);
    // it comes on also where the list of all did not come
    await motions.refresh().catch(() => undefined);
    playback.edit({ motion: id, position: Math.round(playback.position(performance.now()) * 1e6) });
  } catch (error) {
    showProblem(library, item.name, error);
  }
}
