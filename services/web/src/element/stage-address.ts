/** Parsing of the `src` attribute: server, session or motion, and access token. Pure. */

import { parseUrlToken } from "../client/access";
import type { PlaybackKind } from "../engine/playback";

export interface StageAddress {
  /** Origin of the server, `http(s)://host`. */
  server: string;
  kind: PlaybackKind;
  /** Id of the session or motion; null for the running session. */
  id: string | null;
  token: string | null;
  /** Query of the address, for further options such as `name`. */
  query: URLSearchParams;
}

const STREAM_PATH = /^\/v1\/(sessions|motions)\/([^/]+)(?:\/(?:stream|control))?\/?$/;

/**
 * Parse the address of a page, session or motion: `https://stage.example/`, `...?session=ID`, `...?motion=ID` or
 * `.../v1/sessions/ID`, each optionally with `#share=...` or `#token=...`. A relative address is resolved against
 * `base`. Returns null for any other address.
 */
export function parseStageAddress(src: string, base: string): StageAddress | null {
  if (!URL.canParse(src, base)) return null;
  const { protocol, origin, pathname, searchParams: query, hash } = new URL(src, base);
  if (protocol !== "http:" && protocol !== "https:") return null;
  const common = { server: origin, token: parseUrlToken(hash), query };
  const [, kind, id] = STREAM_PATH.exec(pathname) ?? [];
  if (id) return { ...common, kind: kind as PlaybackKind, id: decodeURIComponent(id) };
  const [session, motion] = [query.get("session"), query.get("motion")];
  if (!session && motion) return { ...common, kind: "motions", id: motion };
  return { ...common, kind: "sessions", id: session || null };
}
