/** Names of avatars in their files. */

/** Texts that programs write in place of a missing name. */
const PLACEHOLDERS: ReadonlySet<string> = new Set(["undefined", "null", "none", "nan"]);
const MAX_LENGTH = 80;

/** Return a name to show: without control characters and with single spaces; null if nothing remains or it is none. */
export function cleanName(name: string | null): string | null {
  const text = (name ?? "")
    .replace(/[\p{Cc}\p{Cf}\p{Cn}\p{Co}\p{Cs}\p{Zl}\p{Zp}]+/gu, " ")
    .replace(/\s+/g, " ")
    .trim();
  if (!/[\p{L}\p{N}\p{S}\p{P}]/u.test(text) || PLACEHOLDERS.has(text.toLowerCase())) return null;
  return [...text].slice(0, MAX_LENGTH).join("");
}

/** Return the name of a file without its extension. */
export function nameOfFile(fileName: string): string {
  return cleanName(fileName.replace(/(?<=.)\.\w+$/, "")) ?? fileName;
}
