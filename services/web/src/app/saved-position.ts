/** Where a motion watched alone was left, kept while the page is loaded anew. A session's timeline goes on by itself. */

import { tabStorage } from "../storage/web-storage";
import type { Playback } from "./playback";

const STORAGE_KEY = "bunraku.left";

interface SavedPosition {
  motion: string;
  /** Seconds. */
  position: number;
  playing: boolean;
  loop: boolean;
}

/** Keeps where a room's motion is at local `now`, milliseconds. */
export function savePosition(playback: Playback, now: number): void {
  const { timeline } = playback.viewer;
  if (playback.kind !== "motions" || !timeline) return;
  tabStorage.putJson(STORAGE_KEY, {
    motion: playback.id,
    position: playback.position(now),
    playing: timeline.playing,
    loop: timeline.loop,
  } satisfies SavedPosition);
}

/** Goes on where this room's motion was left, once. */
export function restorePosition(playback: Playback): void {
  const left = tabStorage.getJson(STORAGE_KEY) as SavedPosition | null;
  tabStorage.remove(STORAGE_KEY);
  if (left?.motion !== playback.id) return;
  const { position, playing, loop } = left;
  playback.viewer.addEventListener("timeline", () => playback.viewer.edit({ position, playing, loop }), { once: true });
}
