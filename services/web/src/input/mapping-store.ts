/** The user's mapping, kept in the browser. */
import { DEFAULT_MAPPING, readMapping, type Mapping } from "./mapping";

const KEY = "bunraku.mapping";
/** Of the form of what is kept; another's is left alone. */
const VERSION = 1;

/** The mapping kept, or the default where there is none that can be read. */
export function loadMapping(): Mapping {
  try {
    const kept: unknown = JSON.parse(localStorage.getItem(KEY) ?? "null");
    if (typeof kept !== "object" || kept === null || (kept as { version?: unknown }).version !== VERSION) return DEFAULT_MAPPING;
    return readMapping((kept as { mapping?: unknown }).mapping) ?? DEFAULT_MAPPING;
  } catch {
    return DEFAULT_MAPPING; // Not JSON, or storage is forbidden.
  }
}

/** Keeps a mapping; the default is kept by keeping none, so that a better one later reaches those who changed nothing. */
export function saveMapping(mapping: Mapping): void {
  try {
    if (mapping === DEFAULT_MAPPING) localStorage.removeItem(KEY);
    else localStorage.setItem(KEY, JSON.stringify({ version: VERSION, mapping }));
  } catch {
    // Storage may be forbidden or full; the mapping then lasts as long as the page.
  }
}
