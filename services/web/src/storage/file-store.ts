/**
 * Files that the browser keeps, by key, in a database of its own. Where that is forbidden or full nothing is kept or found, and
 * nothing fails: a file then lasts as long as the page.
 */
export class FileStore {
  #database: Promise<IDBDatabase | null> | null = null;

  constructor(private readonly name: string) {}

  async get(key: string): Promise<File | null> {
    const found = await this.#runRequest("readonly", (files) => files.get(key));
    return found instanceof File ? found : null;
  }

  /** Whether it is kept now. */
  async put(key: string, file: File): Promise<boolean> {
    return (await this.#runRequest("readwrite", (files) => files.put(file, key))) !== null;
  }

  async remove(key: string): Promise<void> {
    await this.#runRequest("readwrite", (files) => files.delete(key));
  }

  /** What a request gives once its transaction is through; null where it fails. */
  async #runRequest<T>(
    mode: IDBTransactionMode,
    createRequest: (files: IDBObjectStore) => IDBRequest<T>,
  ): Promise<T | null> {
    const database = await (this.#database ??= this.#openDatabase());
    if (!database) return null;
    return new Promise((done) => {
      try {
        const transaction = database.transaction(OBJECT_STORE, mode);
        const request = createRequest(transaction.objectStore(OBJECT_STORE));
        transaction.oncomplete = () => done(request.result);
        transaction.onerror = transaction.onabort = () => done(null);
      } catch {
        // the database was closed, or the file cannot be stored
        done(null);
      }
    });
  }

  #openDatabase(): Promise<IDBDatabase | null> {
    return new Promise((done) => {
      try {
        const request = indexedDB.open(this.name, 1);
        request.onupgradeneeded = () => request.result.createObjectStore(OBJECT_STORE);
        request.onsuccess = () => done(request.result);
        request.onerror = request.onblocked = () => done(null);
      } catch {
        // forbidden
        done(null);
      }
    });
  }
}

const OBJECT_STORE = "files";
