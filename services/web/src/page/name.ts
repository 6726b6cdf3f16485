/** The name others see beside one's colour: from the address (`?name=`), else the one kept, else one of these. */
const NAMES = ["Matsu", "Ume", "Kiku", "Fuji", "Sakura", "Momiji", "Yanagi", "Tsubaki", "Hagi", "Kiri", "Ayame", "Susuki"];
const KEY = "bunraku.name";
const LONGEST = 40;

export function ownName(query: URLSearchParams, pick: number): string {
  const asked = query.get("name")?.trim().slice(0, LONGEST);
  try {
    if (asked) localStorage.setItem(KEY, asked);
    const kept = asked || localStorage.getItem(KEY);
    if (kept) return kept;
    const name = NAMES[Math.floor(pick * NAMES.length)];
    localStorage.setItem(KEY, name);
    return name;
  } catch {
    return asked || NAMES[Math.floor(pick * NAMES.length)]; // Storage may be forbidden.
  }
}
