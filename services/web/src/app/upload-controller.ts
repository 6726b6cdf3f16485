/** Uploads of the page, loaded with the first one. */
import { type Motion, uploadTakes } from "../client/api";
import { translate } from "../i18n/translator";
import type { LibraryPanel } from "../ui/library/library-panel";
import { createUploadList } from "../ui/library/upload-list";
import { UploadQueue } from "../ui/library/upload-queue";

export interface UploadTarget {
  readonly library: LibraryPanel;
  toast(message: string): void;
  /** Show the library with new motions. */
  refresh(): Promise<void>;
  /** Show motions that the server stores later. */
  refreshLater(): Promise<void>;
  /** Play a new motion. On a phone, the library closes unless `keepsLibrary`. */
  play(id: string, keepsLibrary: boolean): Promise<void>;
}

let queue: UploadQueue | null = null;

/** Append files to the queue of the page. The longest motion of the first of them is played when it is stored. */
export function uploadFiles(target: UploadTarget, files: readonly File[]): void {
  queue ??= new UploadQueue({
    upload: uploadTakes,
    library: target.library,
    createList: (cancelAll) => createUploadList(target.library.uploads, target.library.drop, cancelAll),
    onStored: (motions, isFirst, hasMore) =>
      isFirst ? target.play(findLongest(motions).id, hasMore) : target.refresh(),
    onPending(count) {
      target.toast(translate("{count} more takes follow in the library", { count }));
      void target.refreshLater();
    },
    onFinished(count) {
      if (count > 1) target.toast(translate("{count} dances were added to the library", { count }));
    },
  });
  void queue.add(files);
}

function findLongest(motions: readonly Motion[]): Motion {
  return motions.reduce((longest, motion) => (motion.duration > longest.duration ? motion : longest));
}
