/** Storage of the user's mapping in the browser. */
import { browserStorage } from "../storage/web-storage";
import { DEFAULT_MAPPING, type Mapping, parseMapping } from "./mapping";

const STORAGE_KEY = "bunraku.mapping";
/** Version of the stored format; other versions are ignored. */
const STORAGE_VERSION = 1;

/** Return the stored mapping, or the default if there is none that can be read. */
export function loadMapping(): Mapping {
  const stored = browserStorage.getJson(STORAGE_KEY) as { version?: unknown; mapping?: unknown } | null;
  return (stored?.version === STORAGE_VERSION && parseMapping(stored.mapping)) || DEFAULT_MAPPING;
}

/** Store a mapping. The default is removed instead, so that users who changed nothing get a later default. */
export function saveMapping(mapping: Mapping): void {
  if (mapping === DEFAULT_MAPPING) browserStorage.remove(STORAGE_KEY);
  else browserStorage.putJson(STORAGE_KEY, { version: STORAGE_VERSION, mapping });
}
