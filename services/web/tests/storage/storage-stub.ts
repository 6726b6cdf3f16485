/** Stubs of the browser's storage; `vi.unstubAllGlobals` removes them. */
import { vi } from "vitest";

type Name = "localStorage" | "sessionStorage";

/** Replace a storage by one that stores its texts in the returned map. */
export function stubStorage(name: Name): Map<string, string> {
  const stored = new Map<string, string>();
  vi.stubGlobal(name, {
    getItem: (key: string) => stored.get(key) ?? null,
    setItem: (key: string, value: string) => void stored.set(key, value),
    removeItem: (key: string) => void stored.delete(key),
  });
  return stored;
}

/** Replace a storage by one whose methods throw SecurityError. */
export function forbidStorage(name: Name): void {
  const forbidden = () => {
    throw new DOMException("The operation is insecure.", "SecurityError");
  };
  vi.stubGlobal(name, { getItem: forbidden, setItem: forbidden, removeItem: forbidden });
}
