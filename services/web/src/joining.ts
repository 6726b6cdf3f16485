/** A further dance beside those on the stage: asked of the library, and danced by everyone once it is there. */
import { addPerformers } from "./client/library";
import type { Library, Piece } from "./page/library";
import { tell } from "./page/uploads";
import type { Pieces } from "./page/pieces";
import type { Room } from "./room";
import { MOST_PERFORMERS } from "./wire/limbs";
import { say } from "./words/say";

/** Adds who dances in `piece` to the stage of `room`, where there is room for them. The dance goes on where it is. What is wrong is told in the library. */
export async function addToStage(piece: Piece, room: Room, pieces: Pieces, library: Pick<Library, "problem">): Promise<void> {
  const { motion, performers } = room.viewer;
  if (motion === null) return;
  if (performers.length + piece.performers > MOST_PERFORMERS) {
    library.problem(piece.name, say("There is no more room on the stage"), say("{count} dancers are the most that a stage has", { count: MOST_PERFORMERS }), null);
    return;
  }
  try {
    const { id } = await addPerformers(motion, [piece.id]);
    // it comes on also where the list of all did not come
    await pieces.refresh().catch(() => undefined);
    room.edit({ motion: id, position: Math.round(room.position(performance.now()) * 1e6) });
  } catch (error) {
    tell(library, piece.name, error);
  }
}
