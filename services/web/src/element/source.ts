/** What the address in `src` names: a server, what is to be seen there, and the token by which one comes in. Pure. */
import { tokenIn } from "../client/access";
import type { Place } from "../room";

export interface Source {
  /** The server's origin, `http(s)://host`. */
  server: string;
  place: Place;
  /** Of the session or the motion; null for the session that is on. */
  id: string | null;
  token: string | null;
  /** What else the address says, such as `name`. */
  query: URLSearchParams;
}

const PATH = /^\/v1\/(sessions|motions)\/([^/]+)(?:\/(?:stream|control))?\/?$/;

/**
 * Reads the address of a page, session or motion of a server, with `base` for one that says no host: `https://stage.example/`,
 * `...?session=ID`, `...?motion=ID`, `.../v1/sessions/ID`, each also with `#share=...` or `#token=...`. Null where it is no such address.
 */
export function readSource(src: string, base: string): Source | null {
  if (!URL.canParse(src, base)) return null;
  const { protocol, origin, pathname, searchParams: query, hash } = new URL(src, base);
  if (protocol !== "http:" && protocol !== "https:") return null;
  const source = { server: origin, token: tokenIn(hash), query };
  const [, place, id] = PATH.exec(pathname) ?? [];
  if (id) return { ...source, place: place as Place, id: decodeURIComponent(id) };
  const [session, motion] = [query.get("session"), query.get("motion")];
  if (!session && motion) return { ...source, place: "motions", id: motion };
  return { ...source, place: "sessions", id: session || null };
}
