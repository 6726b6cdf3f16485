/** A file handed to the person, as the browser keeps downloads. */
import { element } from "../dom";

/** The browser has long begun to read it by then. Milliseconds. */
const URL_LIFETIME_MS = 60_000;

export function saveFile(content: Blob, name: string): void {
  const address = URL.createObjectURL(content);
  element("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), URL_LIFETIME_MS);
}
