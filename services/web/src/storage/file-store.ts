const OBJECT_STORE = "files";

/**
 * Files stored in the browser by key, in a dedicated IndexedDB database. If storage is forbidden or full, nothing is
 * stored or found and no method throws.
 */
export class FileStore {
  #database: Promise<IDBDatabase | null> | null = null;

  constructor(private readonly name: string) {}

  async get(key: string): Promise<File | null> {
    const file = await this.#runRequest("readonly", (files) => files.get(key));
    return file instanceof File ? file : null;
  }

  /** Store a file. Returns whether it was stored. */
  async put(key: string, file: File): Promise<boolean> {
    return (await this.#runRequest("readwrite", (files) => files.put(file, key))) !== null;
  }

  async remove(key: string): Promise<void> {
    await this.#runRequest("readwrite", (files) => files.delete(key));
  }

  /** Run a request and return its result after the transaction completed; null if it failed. */
  async #runRequest<T>(
    mode: IDBTransactionMode,
    createRequest: (files: IDBObjectStore) => IDBRequest<T>,
  ): Promise<T | null> {
    const database = await (this.#database ??= this.#openDatabase());
    if (!database) return null;
    return new Promise((resolve) => {
      try {
        const transaction = database.transaction(OBJECT_STORE, mode);
        const request = createRequest(transaction.objectStore(OBJECT_STORE));
        transaction.oncomplete = () => resolve(request.result);
        transaction.onerror = transaction.onabort = () => resolve(null);
      } catch {
        // The database was closed, or the file cannot be stored.
        resolve(null);
      }
    });
  }

  #openDatabase(): Promise<IDBDatabase | null> {
    return new Promise((resolve) => {
      try {
        const request = indexedDB.open(this.name, 1);
        request.onupgradeneeded = () => request.result.createObjectStore(OBJECT_STORE);
        request.onsuccess = () => resolve(request.result);
        request.onerror = request.onblocked = () => resolve(null);
      } catch {
        // Access to IndexedDB is forbidden.
        resolve(null);
      }
    });
  }
}
