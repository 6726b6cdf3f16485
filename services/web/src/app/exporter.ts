/** What is taken from the page: dances as files, and the stage as a picture. Between library, writers, stage and the browser. */
import { ProblemError } from "../client/problem";
import type { ExportFormat, ExportSource } from "../export/export-file";
import { translate } from "../i18n/translator";
import type { Stage } from "../stage/stage";
import { saveFile } from "../ui/library/file-download";
import type { MotionItem } from "../ui/library/library-panel";
import { showProblem } from "../ui/library/upload";
import type { Page } from "../ui/page";
import type { Playback } from "./playback";

/** Of a download's progress, the part in which its blocks come. */
const FETCH_PROGRESS_SHARE = 0.5;

export class Exporter {
  #capturing = false;

  constructor(
    private readonly page: Page,
    private readonly getState: () => { room: Playback | null; stage: Stage | null },
  ) {}

  /** Makes a file of the whole dances of these `performers` and saves it; what is wrong is told in the library. */
  async downloadMotion(motion: MotionItem, format: ExportFormat, performers: readonly number[]): Promise<void> {
    const abort = new AbortController();
    const { signal } = abort;
    // one of several
    const part =
      performers.length < motion.performers ? `, ${translate("Dancer {number}", { number: performers[0] + 1 })}` : "";
    const row = this.page.library.addDownload(`${motion.name}${part}, ${format.toUpperCase()}`, () => abort.abort());
    try {
      const [{ bestBlocks, fileName, makeFile }, looks] = await loadExportModules();
      const sources: ExportSource[] = [];
      for (const performer of performers) {
        const held = this.getState().room?.viewer.blocksOf(motion.id, performer) ?? null;
        const told = (share: number) =>
          row.showProgress(
            translate("fetching the dance"),
            ((sources.length + share) / performers.length) * FETCH_PROGRESS_SHARE,
          );
        sources.push(await bestBlocks(motion.id, { performer, existing: held, signal, onProgress: told }));
      }
      const file = await makeFile(format, motion.name, sources, {
        puppets: looks,
        signal,
        onProgress: (share) =>
          row.showProgress(translate("writing the file"), FETCH_PROGRESS_SHARE + share * (1 - FETCH_PROGRESS_SHARE)),
      });
      this.#save(file, fileName(motion.name, format, part));
    } catch (error) {
      if (!signal.aborted) showProblem(this.page.library, motion.name, error);
    } finally {
      row.remove();
    }
  }

  /** Saves the stage as it is now as a picture of this `name`. */
  async savePicture(name: string): Promise<void> {
    const { stage } = this.getState();
    if (!stage || this.#capturing) return;
    this.#capturing = true;
    try {
      const picture = await stage.takePicture();
      const [{ fileName }] = await loadExportModules();
      this.#save(picture, fileName(name || "Bunraku", "png"));
    } catch (error) {
      this.page.toast(
        error instanceof ProblemError
          ? translate("{title}: {detail}", error)
          : translate("This browser could not draw the picture"),
      );
      if (!(error instanceof ProblemError)) console.warn(error);
    } finally {
      this.#capturing = false;
    }
  }

  #save(file: Blob, name: string): void {
    saveFile(file, name);
    this.page.toast(translate("Saved {name}", { name }));
  }
}

/** What makes files, fetched when it is first needed, and what the stage knows of the puppet's looks. */
async function loadExportModules() {
  try {
    const [files, { facePicture, puppetModel }] = await Promise.all([
      import("./export-chunk"),
      import("./stage-chunk"),
    ]);
    return [files, { renderFacePng: facePicture, createModel: puppetModel }] as const;
  } catch {
    throw ProblemError.unreachable();
  }
}
