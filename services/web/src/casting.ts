/** Who dances in the place of one of the dancers on this page: the puppet, or an avatar that the person brought, which never leaves the browser. */
import type { AvatarModel } from "./avatar/model";
import { AvatarProblem, LARGEST, tooLarge } from "./avatar/problem";
import type { Chosen } from "./input/chosen";
import type { DanceAs } from "./page/dance-as";
import type { Library } from "./page/library";
import type { Toast } from "./page/toast";
import type { Stage } from "./stage/stage";
import type { MakePerformer } from "./stage/troupe";
import type { FileStore } from "./storage/files";
import type { Store } from "./storage/store";
import { MOST_PERFORMERS } from "./wire/limbs";
import { say } from "./words/say";

/** Where the file is kept, and whether it dances; of dancers behind the first with their number from 1. */
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

  #restored = false;
  readonly #file: string;
  readonly #choice: string;

  /** In the place of a performer, by number. */
  constructor(private readonly options: CastingOptions, private readonly performer = 0) {
    const own = performer > 0 ? `.${performer + 1}` : "";
    [this.#file, this.#choice] = [FILE + own, DANCING + own];
    this.#render();
  }

  /** The stage it is about, once there is one. */
  set stage(stage: Pick<Stage, "danceBy">) {
    this.#stage = stage;
    if (this.#dancing) stage.danceBy(this.#dancing, this.performer);
  }

  /** Brings back the avatar of the last visit, if there was one; once. */
  async restore(): Promise<void> {
    if (this.#restored) return;
    this.#restored = true;
    const { files, choices } = this.options;
    const dancing = choices.get(this.#choice);
    if (dancing === null) return;
    const file = await files.get(this.#file);
    if (!file || this.#reading || this.#model) return;
    await this.#read(file, dancing === "yes");
  }

  /** Dances as what is in a file from now on, and at the next visit; tells why where it cannot. */
  async take(file: File): Promise<void> {
    if (!(await this.#read(file, true))) return;
    const { page, files, choices } = this.options;
    choices.put(this.#choice, "yes");
    const kept = await files.put(this.#file, file);
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
    this.options.choices.put(this.#choice, avatar ? "yes" : "no");
    this.#show(avatar);
  }

  /** Forgets the avatar, also for the next visit. */
  async remove(): Promise<void> {
    this.#reading = null;
    this.#drop();
    this.options.choices.remove(this.#choice);
    await this.options.files.remove(this.#file);
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
    this.#stage?.danceBy(this.#dancing, this.performer);
    this.#render();
  }

  /** The puppet dances, and the model is no more. */
  #drop(): void {
    if (this.#dancing) this.#stage?.danceBy(null, this.performer);
    this.#dancing = this.#make = null;
    this.#model?.dispose();
    this.#model = null;
    this.#render();
  }

  #render(): void {
    this.options.page.library.danceAs.render(this.performer, { name: this.#model?.name ?? null, dancing: this.#dancing !== null, reading: this.#reading?.name ?? null });
  }
}

/** Who dances in the places of all the dancers that there may be. */
export class Castings {
  readonly #all: readonly Casting[];

  /** The person brings avatars for the `choice`'s performer. */
  constructor(options: CastingOptions, private readonly choice: Pick<Chosen, "performer">) {
    this.#all = Array.from({ length: MOST_PERFORMERS }, (_, performer) => new Casting(options, performer));
  }

  /** In the place of the chosen dancer. */
  get chosen(): Casting {
    return this.#all[this.choice.performer];
  }

  /** The stage they are about, once there is one. */
  set stage(stage: Pick<Stage, "danceBy">) {
    for (const casting of this.#all) casting.stage = stage;
  }

  /** Brings back the avatars of the last visit for so many dancers: those of others are not read before they are seen. */
  restore(dancers: number): void {
    for (const casting of this.#all.slice(0, dancers)) void casting.restore();
  }
}
