/** What is taken from the page: dances as files, and the stage as a picture. Between library, writers, stage and the browser. */
import { ProblemError } from "./client/problem";
import type { Format, Source } from "./export/file";
import type { Piece } from "./page/library";
import type { Page } from "./page/page";
import { saveFile } from "./page/save-file";
import { tell } from "./page/uploads";
import type { Room } from "./room";
import type { Stage } from "./stage/stage";
import { say } from "./words/say";

/** Of a download's progress, the part in which its blocks come. */
const FETCHED = 0.5;

export class Exporting {
  #taking = false;

  constructor(private readonly page: Page, private readonly now: () => { room: Room | null; stage: Stage | null }) {}

  /** Makes a file of the whole dances of these `performers` and saves it; what is wrong is told in the library. */
  async download(piece: Piece, format: Format, performers: readonly number[]): Promise<void> {
    const abort = new AbortController();
    const { signal } = abort;
    // one of several
    const part = performers.length < piece.performers ? `, ${say("Dancer {number}", { number: performers[0] + 1 })}` : "";
    const row = this.page.library.download(`${piece.name}${part}, ${format.toUpperCase()}`, () => abort.abort());
    try {
      const [{ bestBlocks, fileName, makeFile }, looks] = await writers();
      const sources: Source[] = [];
      for (const performer of performers) {
        const held = this.now().room?.viewer.held(piece.id, performer) ?? null;
        const told = (share: number) => row.doing(say("fetching the dance"), ((sources.length + share) / performers.length) * FETCHED);
        sources.push(await bestBlocks(piece.id, { performer, held, signal, told }));
      }
      const file = await makeFile(format, piece.name, sources, { looks, signal, told: (share) => row.doing(say("writing the file"), FETCHED + share * (1 - FETCHED)) });
      this.#save(file, fileName(piece.name, format, part));
    } catch (error) {
      if (!signal.aborted) tell(this.page.library, piece.name, error);
    } finally {
      row.remove();
    }
  }

  /** Saves the stage as it is now as a picture of this `name`. */
  async picture(name: string): Promise<void> {
    const { stage } = this.now();
    if (!stage || this.#taking) return;
    this.#taking = true;
    try {
      const picture = await stage.picture();
      const [{ fileName }] = await writers();
      this.#save(picture, fileName(name || "Bunraku", "png"));
    } catch (error) {
      this.page.toast(error instanceof ProblemError ? say("{title}: {detail}", error) : say("This browser could not draw the picture"));
      if (!(error instanceof ProblemError)) console.warn(error);
    } finally {
      this.#taking = false;
    }
  }

  #save(file: Blob, name: string): void {
    saveFile(file, name);
    this.page.toast(say("Saved {name}", { name }));
  }
}

/** What makes files, fetched when it is first needed, and what the stage knows of the puppet's looks. */
async function writers() {
  try {
    const [files, { facePicture, puppetModel }] = await Promise.all([import("./files"), import("./theatre")]);
    return [files, { face: facePicture, model: puppetModel }] as const;
  } catch {
    throw ProblemError.unreachable();
  }
}
