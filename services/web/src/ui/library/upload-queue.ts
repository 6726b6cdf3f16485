/** Queue of uploads of motion files, one after another. A file that fails does not affect the others. */
import type { Motion, SkippedTake, StoredTakes, UploadProgress } from "../../client/api";
import { joinList, translate } from "../../i18n/translator";
import type { LibraryPanel } from "./library-panel";
import { showProblem } from "./problem-report";
import { shareOfStage, type UploadList, type UploadRow } from "./upload-list";

/** Takes that were left out that a message lists. */
const MAX_LISTED_TAKES = 10;

export interface UploadQueueOptions {
  upload(file: File, onProgress: (progress: UploadProgress) => void, signal: AbortSignal): Promise<StoredTakes>;
  readonly library: Pick<LibraryPanel, "problem" | "clearProblems">;
  /** Create the list in which uploads are shown. */
  createList(cancelAll: () => void): UploadList;
  /**
   * Called with the motions of a file, whether it is the first with any of the files that were added together, and
   * whether the library has more to show: files that wait, or takes that were left out.
   */
  onStored(motions: readonly Motion[], isFirst: boolean, hasMore: boolean): Promise<void>;
  /** Called with the number of takes that the server stores later. */
  onPending(count: number): void;
  /** Called at the end with the number of stored motions. */
  onFinished(count: number): void;
}

interface Entry {
  readonly file: File;
  readonly abort: AbortController;
  readonly row: UploadRow;
  readonly batch: Batch;
}

/** Files that were added together. */
interface Batch {
  hasStored: boolean;
}

export class UploadQueue {
  readonly #list: UploadList;
  #waiting: Entry[] = [];
  #current: Entry | null = null;
  #running: Promise<void> | null = null;
  /** Files since the queue was last empty: all but those cancelled while waiting, and those finished. */
  #count = 0;
  #finished = 0;
  #stored = 0;

  constructor(private readonly options: UploadQueueOptions) {
    this.#list = options.createList(() => this.cancelAll());
  }

  /** Append files; resolves when the queue is empty. */
  add(files: readonly File[]): Promise<void> {
    if (!this.#running) {
      [this.#count, this.#finished, this.#stored] = [0, 0, 0];
      if (files.length > 0) this.options.library.clearProblems();
    }
    const batch: Batch = { hasStored: false };
    for (const file of files) {
      const row = this.#list.addFile(file.name, () => this.#cancel(entry));
      const entry: Entry = { file, abort: new AbortController(), row, batch };
      this.#waiting.push(entry);
    }
    this.#count += files.length;
    this.#running ??= this.#run().finally(() => {
      this.#running = null;
    });
    this.#showSummary(0);
    return this.#running;
  }

  cancelAll(): void {
    for (const entry of [...this.#waiting]) this.#cancel(entry);
    if (this.#current) this.#cancel(this.#current);
  }

  #cancel(entry: Entry): void {
    entry.abort.abort();
    if (entry === this.#current) return;
    this.#waiting = this.#waiting.filter((waiting) => waiting !== entry);
    this.#count--;
    entry.row.remove();
    this.#showSummary(0);
  }

  async #run(): Promise<void> {
    for (let entry = this.#waiting.shift(); entry; entry = this.#waiting.shift()) {
      this.#current = entry;
      await this.#upload(entry);
      this.#current = null;
      this.#finished++;
    }
    this.#list.showSummary(null);
    this.options.onFinished(this.#stored);
  }

  async #upload({ file, abort, row, batch }: Entry): Promise<void> {
    const startMs = performance.now();
    const { upload, library, onStored, onPending } = this.options;
    this.#showSummary(0);
    try {
      const { items, skipped, pending } = await upload(
        file,
        (progress) => {
          row.show(progress, file.size, (performance.now() - startMs) / 1000);
          // Sending and the work on the server count equally.
          this.#showSummary((shareOfStage(progress) + (progress.stage === "sending" ? 0 : 1)) / 2);
        },
        abort.signal,
      );
      row.remove();
      showSkipped(library, file.name, skipped);
      if (pending.length > 0) onPending(pending.length);
      const isFirst = !batch.hasStored && items.length > 0;
      batch.hasStored ||= isFirst;
      this.#stored += items.length;
      await onStored(items, isFirst, this.#waiting.length > 0 || skipped.length > 0);
    } catch (error) {
      row.remove();
      if (abort.signal.aborted) return;
      try {
        showProblem(library, file.name, error);
      } catch (unexpected) {
        // The other files go on.
        reportError(unexpected);
      }
    }
  }

  /** Show the current file, of which this fraction is done, if there are several. */
  #showSummary(fraction: number): void {
    const [count, number] = [this.#count, this.#finished + 1];
    this.#list.showSummary(count > 1 ? { number, count, fraction: (this.#finished + fraction) / count } : null);
  }
}

/** Say which takes of a file were left out, and why. */
function showSkipped(library: Pick<LibraryPanel, "problem">, name: string, skipped: readonly SkippedTake[]): void {
  if (skipped.length === 0) return;
  const reasons = skipped.slice(0, MAX_LISTED_TAKES).map(({ take, title, detail, line }) => {
    const reason = line === null ? detail : translate("{detail} (line {line})", { detail, line });
    return take === null ? reason : translate("{name}: {title}", { name: take, title: joinList([title, reason]) });
  });
  if (skipped.length > MAX_LISTED_TAKES)
    reasons.push(translate("and {count} more", { count: skipped.length - MAX_LISTED_TAKES }));
  const hint = skipped.length === 1 ? skipped[0].hint : null;
  library.problem(name, translate("Not all of its takes are in the library"), reasons.join("\n"), hint);
}
