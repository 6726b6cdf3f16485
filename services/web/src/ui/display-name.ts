/** Display name of this page's user, as other users see it. */
import { browserStorage } from "../storage/web-storage";

const DEFAULT_NAMES = [
  "Matsu",
  "Ume",
  "Kiku",
  "Fuji",
  "Sakura",
  "Momiji",
  "Yanagi",
  "Tsubaki",
  "Hagi",
  "Kiri",
  "Ayame",
  "Susuki",
];
const STORAGE_KEY = "bunraku.name";
const MAX_NAME_LENGTH = 40;

/**
 * Return the name in the address (`?name=`), else the stored one, else a default picked by `random` (0 to 1). Stores
 * it.
 */
export function resolveDisplayName(query: URLSearchParams, random: number): string {
  const name =
    query.get("name")?.trim().slice(0, MAX_NAME_LENGTH) ||
    browserStorage.get(STORAGE_KEY) ||
    DEFAULT_NAMES[Math.floor(random * DEFAULT_NAMES.length)];
  browserStorage.put(STORAGE_KEY, name);
  return name;
}
