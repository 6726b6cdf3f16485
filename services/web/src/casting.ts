/** Who dances on this page: the puppet, or an avatar that the person brought, which never leaves the browser. */
import type { AvatarModel } from "./avatar/model";
import { AvatarProblem, LARGEST, tooLarge } from "./avatar/problem";
import type { DanceAs } from "./page/dance-as";
import type { Library } from "./page/library";
import type { Toast } from "./page/toast";
import type { Stage } from "./stage/stage";
import type { MakePerformer } from "./stage/troupe";
import type { FileStore } from "./storage/files";
import type { Store } from "./storage/store";
import { say } from "./words/say";

/** Where the file is kept, and whether it dances. */
const FILE = "avatar";
const DANCING = "bunraku.avatar";

export interface CastingOptions {
  page: { readonly library: Pick<Library, "problem"> & { readonly danceAs: DanceAs }; readonly toast: Toast };
  files: Pick<FileStore, "get" | "put" | "remove">;
  choices: Pick<Store, "get" | "put" | "remove">;
}

export class Casting {
  #stage: Pick<Stage, "danceBy"> | null = null;
  #model: AvatarModel | null = null;
  /** Makes the avatar of the model for a dancer's lengths. */
  #make: MakePerformer | null = null;
  /** The same while it dances; null while the puppet does. */
  #dancing: MakePerformer | null = null;
  /** The file that is being read; a later one makes it stale. */
  #reading: File | null = null;

  constructor(private readonly options: CastingOptions) {
    this.#render();
  }

  /** The stage it is about, once there is one. */
  set stage(stage: Pick<Stage, "danceBy">) {
    this.#stage = stage;
    if (this.#dancing) stage.danceBy(this.#dancing);
  }

  /** Brings back the avatar of the last visit, if there was one. */
  async restore(): Promise<void> {
    const { files, choices } = this.options;
    const dancing = choices.get(DANCING);
    if (dancing === null) return;
    const file = await files.get(FILE);
    if (!file || this.#reading || this.#model) return;
    await this.#read(file, dancing === "yes");
  }

  /** Dances as what is in a file from now on, and at the next visit; tells why where it cannot. */
  async take(file: File): Promise<void> {
    if (!(await this.#read(file, true))) return;
    const { page, files, choices } = this.options;
    choices.put(DANCING, "yes");
    const kept = await files.put(FILE, file);
    const name = this.#model?.name ?? file.name;
    page.toast(
      kept
        ? say("{name} dances here; everyone else sees the puppet", { name })
        : say("{name} dances here; everyone else sees the puppet. This browser keeps it for this visit only", { name }),
    );
  }

  /** The avatar dances, or the puppet does. */
  choose(avatar: boolean): void {
    if (!this.#model) return;
    this.options.choices.put(DANCING, avatar ? "yes" : "no");
    this.#show(avatar);
  }

  /** Forgets the avatar, also for the next visit. */
  async remove(): Promise<void> {
    this.#reading = null;
    this.#drop();
    this.options.choices.remove(DANCING);
    await this.options.files.remove(FILE);
  }

  async #read(file: File, dancing: boolean): Promise<boolean> {
    const { page } = this.options;
    this.#reading = file;
    this.#render();
    try {
      if (file.size > LARGEST) throw tooLarge(file.size);
      const [{ Avatar, AvatarModel }, bytes] = await Promise.all([import("./avatars"), file.arrayBuffer()]);
      const model = await AvatarModel.read(bytes, file.name.replace(/\.\w+$/, ""));
      if (this.#reading !== file) {
        model.dispose();
        return false;
      }
      this.#drop();
      this.#model = model;
      this.#make = (figure) => new Avatar(model, figure);
      this.#reading = null;
      this.#show(dancing);
      return true;
    } catch (error) {
      if (this.#reading !== file) return false;
      this.#reading = null;
      this.#render();
      const known = error instanceof AvatarProblem;
      page.library.problem(file.name, known ? error.title : say("It could not be read"), known ? error.detail : say("the file or what reads it did not come"), known ? error.hint : say("Try again when the line is back."));
      return false;
    }
  }

  #show(avatar: boolean): void {
    this.#dancing = avatar ? this.#make : null;
    this.#stage?.danceBy(this.#dancing);
    this.#render();
  }

  /** The puppet dances, and the model is no more. */
  #drop(): void {
    if (this.#dancing) this.#stage?.danceBy(null);
    this.#dancing = this.#make = null;
    this.#model?.dispose();
    this.#model = null;
    this.#render();
  }

  #render(): void {
    this.options.page.library.danceAs.render({ name: this.#model?.name ?? null, dancing: this.#dancing !== null, reading: this.#reading?.name ?? null });
  }
}
