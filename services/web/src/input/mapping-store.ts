/** The user's mapping, kept in the browser. */
import { browserStore } from "../storage/store";
import { DEFAULT_MAPPING, readMapping, type Mapping } from "./mapping";

const KEY = "bunraku.mapping";
/** Of the form of what is kept; another's is left alone. */
const VERSION = 1;

/** The mapping kept, or the default where there is none that can be read. */
export function loadMapping(): Mapping {
  const kept = browserStore.getJson(KEY) as { version?: unknown; mapping?: unknown } | null;
  return (kept?.version === VERSION && readMapping(kept.mapping)) || DEFAULT_MAPPING;
}

/** Keeps a mapping; the default is kept by keeping none, so that a better one later reaches those who changed nothing. */
export function saveMapping(mapping: Mapping): void {
  if (mapping === DEFAULT_MAPPING) browserStore.remove(KEY);
  else browserStore.putJson(KEY, { version: VERSION, mapping });
}
