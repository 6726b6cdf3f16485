/** A browser's storage for tests that run without one; `vi.unstubAllGlobals` takes it away. */
import { vi } from "vitest";

type Name = "localStorage" | "sessionStorage";

/** Storage that keeps what is put in the map that is returned. */
export function stubStorage(name: Name): Map<string, string> {
  const kept = new Map<string, string>();
  vi.stubGlobal(name, {
    getItem: (key: string) => kept.get(key) ?? null,
    setItem: (key: string, value: string) => void kept.set(key, value),
    removeItem: (key: string) => void kept.delete(key),
  });
  return kept;
}

/** Storage whose every use is refused. */
export function forbidStorage(name: Name): void {
  const forbidden = () => {
    throw new DOMException("The operation is insecure.", "SecurityError");
  };
  vi.stubGlobal(name, { getItem: forbidden, setItem: forbidden, removeItem: forbidden });
}
