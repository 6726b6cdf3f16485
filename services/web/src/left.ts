/** Where a motion watched alone was left, kept while the page is loaded anew. A session's timeline goes on by itself. */
import type { Room } from "./room";
import { tabStore } from "./storage/store";

const KEY = "bunraku.left";

interface Left {
  motion: string;
  /** Seconds. */
  position: number;
  playing: boolean;
  loop: boolean;
}

/** Keeps where a room's motion is at local `now`, milliseconds. */
export function leave(room: Room, now: number): void {
  const { timeline } = room.viewer;
  if (room.place !== "motions" || !timeline) return;
  tabStore.putJson(KEY, { motion: room.id, position: room.position(now), playing: timeline.playing, loop: timeline.loop } satisfies Left);
}

/** Goes on where this room's motion was left, once. */
export function goOn(room: Room): void {
  const left = tabStore.getJson(KEY) as Left | null;
  tabStore.remove(KEY);
  if (left?.motion !== room.id) return;
  const { position, playing, loop } = left;
  room.viewer.addEventListener("timeline", () => room.viewer.edit({ position, playing, loop }), { once: true });
}
