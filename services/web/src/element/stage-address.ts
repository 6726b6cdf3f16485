/** What the address in `src` names: a server, what is to be seen there, and the token by which one comes in. Pure. */

import type { PlaybackKind } from "../app/playback";
import { parseUrlToken } from "../client/access";

export interface StageAddress {
  /** The server's origin, `http(s)://host`. */
  server: string;
  kind: PlaybackKind;
  /** Of the session or the motion; null for the session that is on. */
  id: string | null;
  token: string | null;
  /** What else the address says, such as `name`. */
  query: URLSearchParams;
}

const STREAM_PATH = /^\/v1\/(sessions|motions)\/([^/]+)(?:\/(?:stream|control))?\/?$/;

/**
 * Reads the address of a page, session or motion of a server, with `base` for one that says no host: `https://stage.example/`,
 * `...?session=ID`, `...?motion=ID`, `.../v1/sessions/ID`, each also with `#share=...` or `#token=...`. Null where it is no such address.
 */
export function parseStageAddress(src: string, base: string): StageAddress | null {
  if (!URL.canParse(src, base)) return null;
  const { protocol, origin, pathname, searchParams: query, hash } = new URL(src, base);
  if (protocol !== "http:" && protocol !== "https:") return null;
  const source = { server: origin, token: parseUrlToken(hash), query };
  const [, place, id] = STREAM_PATH.exec(pathname) ?? [];
  if (id) return { ...source, kind: place as PlaybackKind, id: decodeURIComponent(id) };
  const [session, motion] = [query.get("session"), query.get("motion")];
  if (!session && motion) return { ...source, kind: "motions", id: motion };
  return { ...source, kind: "sessions", id: session || null };
}
