/**
 * Texts that the browser keeps, by key. Where storage is forbidden, full or holds what is no JSON nothing is kept or
 * found, and nothing fails: a choice then lasts as long as the page.
 */
export class WebStorage {
  /** `open` is asked each time: where storage is forbidden, naming it throws already. */
  constructor(private readonly open: () => Storage) {}

  get(key: string): string | null {
    try {
      return this.open().getItem(key);
    } catch {
      return null;
    }
  }

  /** The value under a key that `putJson` wrote, or anybody: null where none can be read. */
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
      // forbidden or full
    }
  }

  putJson(key: string, value: unknown): void {
    this.put(key, JSON.stringify(value));
  }

  remove(key: string): void {
    try {
      this.open().removeItem(key);
    } catch {
      // forbidden
    }
  }
}

/** Kept until the person clears it, for all tabs. */
export const browserStorage = new WebStorage(() => localStorage);

/** Kept for this tab, also when it is loaded again. */
export const tabStorage = new WebStorage(() => sessionStorage);
