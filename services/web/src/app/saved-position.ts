/**
 * Position of a motion with a private timeline, saved while the page reloads. A session's timeline is on the server.
 */
import { tabStorage } from "../storage/web-storage";
import type { RemotePlayback } from "./remote-playback";

const STORAGE_KEY = "bunraku.left";

interface SavedPosition {
  motion: string;
  /** Seconds. */
  position: number;
  playing: boolean;
  loop: boolean;
}

/** Save the position of a motion. Does nothing for a session. */
export function savePosition(playback: RemotePlayback): void {
  const { timeline } = playback;
  if (playback.kind !== "motions" || !timeline) return;
  tabStorage.putJson(STORAGE_KEY, {
    motion: playback.id,
    position: playback.position,
    playing: timeline.playing,
    loop: timeline.loop,
  } satisfies SavedPosition);
}

/** Restore the saved position of this motion, and delete it. */
export function restorePosition(playback: RemotePlayback): void {
  const saved = tabStorage.getJson(STORAGE_KEY) as SavedPosition | null;
  tabStorage.remove(STORAGE_KEY);
  if (saved?.motion !== playback.id) return;
  const { position, playing, loop } = saved;
  const edit = { position: Math.round(position * 1e6), playing, loop };
  playback.addEventListener("timeline", () => playback.edit(edit), { once: true });
}
