/** The user's mapping, kept in the browser. */
import { browserStorage } from "../storage/web-storage";
import { DEFAULT_MAPPING, type Mapping, parseMapping } from "./mapping";

const STORAGE_KEY = "bunraku.mapping";
/** Of the form of what is kept; another's is left alone. */
const STORAGE_VERSION = 1;

/** The mapping kept, or the default where there is none that can be read. */
export function loadMapping(): Mapping {
  const kept = browserStorage.getJson(STORAGE_KEY) as { version?: unknown; mapping?: unknown } | null;
  return (kept?.version === STORAGE_VERSION && parseMapping(kept.mapping)) || DEFAULT_MAPPING;
}

/** Keeps a mapping; the default is kept by keeping none, so that a better one later reaches those who changed nothing. */
export function saveMapping(mapping: Mapping): void {
  if (mapping === DEFAULT_MAPPING) browserStorage.remove(STORAGE_KEY);
  else browserStorage.putJson(STORAGE_KEY, { version: STORAGE_VERSION, mapping });
}
