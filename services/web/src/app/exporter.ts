/** Export of motions as files, and of the stage as a picture. */
import { ProblemError } from "../client/problem";
import type { ExportFormat, ExportSource } from "../export/export-file";
import { translate } from "../i18n/translator";
import { saveFile } from "../ui/library/file-download";
import type { MotionItem } from "../ui/library/motion-item";
import { showProblem } from "../ui/library/upload";
import type { Page } from "../ui/page";

/** Share of a download's progress that fetching its blocks takes; writing the file takes the rest. */
const FETCH_PROGRESS_SHARE = 0.5;

export class Exporter {
  #capturing = false;

  constructor(
    private readonly page: Page,
    private readonly takePicture: () => Promise<Blob>,
  ) {}

  /** Write the whole motion of these performers to a file and save it. Errors are reported in the library. */
  async downloadMotion(motion: MotionItem, format: ExportFormat, performers: readonly number[]): Promise<void> {
    const abort = new AbortController();
    const { signal } = abort;
    const suffix =
      performers.length < motion.performers ? `, ${translate("Dancer {number}", { number: performers[0] + 1 })}` : "";
    const row = this.page.library.addDownload(`${motion.name}${suffix}, ${format.toUpperCase()}`, () => abort.abort());
    try {
      const [{ downloadMotion, exportFile, fileName }, puppets] = await loadExportModules();
      const sources: ExportSource[] = [];
      for (const performer of performers) {
        const onProgress = (share: number) =>
          row.showProgress(
            translate("fetching the dance"),
            ((sources.length + share) / performers.length) * FETCH_PROGRESS_SHARE,
          );
        sources.push(await downloadMotion(motion.id, { performer, signal, onProgress }));
      }
      const file = await exportFile(format, motion.name, sources, {
        puppets,
        signal,
        onProgress: (share) =>
          row.showProgress(translate("writing the file"), FETCH_PROGRESS_SHARE + share * (1 - FETCH_PROGRESS_SHARE)),
      });
      this.#save(file, fileName(motion.name, format, suffix));
    } catch (error) {
      if (!signal.aborted) showProblem(this.page.library, motion.name, error);
    } finally {
      row.remove();
    }
  }

  /** Save the current frame of the stage as a PNG file named after `name`. */
  async savePicture(name: string): Promise<void> {
    if (this.#capturing) return;
    this.#capturing = true;
    try {
      const [{ fileName }, picture] = await Promise.all([loadModule(import("./export-chunk")), this.takePicture()]);
      this.#save(picture, fileName(name || "Bunraku", "png"));
    } catch (error) {
      this.page.toast(
        error instanceof ProblemError
          ? translate("{title}: {detail}", error)
          : translate("The picture could not be drawn. Try again"),
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

/** Load the exporters, and the functions that build the puppet's model and face. */
async function loadExportModules() {
  const [exporters, { createPuppetModel, renderFacePng }] = await loadModule(
    Promise.all([import("./export-chunk"), import("../stage/puppet/puppet-model")]),
  );
  return [exporters, { renderFacePng, createModel: createPuppetModel }] as const;
}

function loadModule<Module>(module: Promise<Module>): Promise<Module> {
  return module.catch(() => {
    throw ProblemError.unreachable();
  });
}
