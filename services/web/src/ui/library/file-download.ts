/** Saving of generated files through the browser's downloads. */
import { element } from "../dom";

/** Time after which the object URL is freed. The browser has started to read it long before. */
const URL_LIFETIME_MS = 60_000;

export function saveFile(content: Blob, name: string): void {
  const address = URL.createObjectURL(content);
  element("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), URL_LIFETIME_MS);
}
