/** Export of motions as files, and of the stage as a picture. */
import { ProblemError } from "../client/problem";
import type { ExportFormat } from "../export/export-file";
import { translate } from "../i18n/translator";
import { saveFile } from "../ui/library/file-download";
import type { MotionItem } from "../ui/library/motion-item";
import { showProblem } from "../ui/library/problem-report";
import type { Page } from "../ui/page";

export class Exporter {
  #capturing = false;

  constructor(
    private readonly page: Page,
    private readonly takePicture: () => Promise<Blob>,
  ) {}

  /** Write the whole motion of these performers to a file and save it. Errors are reported in the library. */
  async downloadMotion(motion: MotionItem, format: ExportFormat, performers: readonly number[]): Promise<void> {
    const { library } = this.page;
    try {
      const { exportMotion } = await loadModule(import("./export-chunk"));
      const exported = await exportMotion(library, motion, format, performers);
      if (exported) this.#save(exported.file, exported.name);
    } catch (error) {
      showProblem(library, motion.name, error);
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

/** Wait for a module. Rejects with ProblemError if it cannot be loaded. */
function loadModule<Module>(module: Promise<Module>): Promise<Module> {
  return module.catch(() => {
    throw ProblemError.unreachable();
  });
}
