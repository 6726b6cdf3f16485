/**
 * Texts and JSON values in the browser's storage. If storage is forbidden or full, or holds invalid JSON, nothing is
 * stored or found and no method throws.
 */
export class WebStorage {
  /** `open` is called at each access: if storage is forbidden, the mere access to the global throws. */
  constructor(private readonly open: () => Storage) {}

  get(key: string): string | null {
    try {
      return this.open().getItem(key);
    } catch {
      return null;
    }
  }

  /** Return the JSON value of a key; null if there is none or it is invalid. The value's type is not checked. */
  getJson(key: string): unknown {
    try {
      return JSON.parse(this.get(key) ?? "null");
    } catch {
      return null;
    }
  }

  put(key: string, text: string): void {
    try {
      this.open().setItem(key, text);
    } catch {
      // Storage is forbidden or full.
    }
  }

  putJson(key: string, value: unknown): void {
    this.put(key, JSON.stringify(value));
  }

  remove(key: string): void {
    try {
      this.open().removeItem(key);
    } catch {
      // Storage is forbidden.
    }
  }
}

/** Storage for all tabs, kept until the user clears it. */
export const browserStorage = new WebStorage(() => localStorage);

/** Storage for this tab, kept while it reloads. */
export const tabStorage = new WebStorage(() => sessionStorage);
