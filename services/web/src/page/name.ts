/** The name others see beside one's colour: from the address (`?name=`), else the one kept, else one of these. */
import { browserStore } from "../storage/store";

const NAMES = ["Matsu", "Ume", "Kiku", "Fuji", "Sakura", "Momiji", "Yanagi", "Tsubaki", "Hagi", "Kiri", "Ayame", "Susuki"];
const KEY = "bunraku.name";
const LONGEST = 40;

export function ownName(query: URLSearchParams, pick: number): string {
  const name = query.get("name")?.trim().slice(0, LONGEST) || browserStore.get(KEY) || NAMES[Math.floor(pick * NAMES.length)];
  browserStore.put(KEY, name);
  return name;
}
