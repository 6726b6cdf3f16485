/** The name others see beside one's colour: from the address (`?name=`), else the one kept, else one of these. */
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

export function resolveDisplayName(query: URLSearchParams, random: number): string {
  const name =
    query.get("name")?.trim().slice(0, MAX_NAME_LENGTH) ||
    browserStorage.get(STORAGE_KEY) ||
    DEFAULT_NAMES[Math.floor(random * DEFAULT_NAMES.length)];
  browserStorage.put(STORAGE_KEY, name);
  return name;
}
