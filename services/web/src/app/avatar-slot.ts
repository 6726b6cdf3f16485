/** Who dances in the place of one of the dancers on this page: the puppet, or an avatar that the person brought, which never leaves the browser. */

import { AvatarError, fileTooLarge, MAX_FILE_BYTES } from "../avatar/error";
import type { AvatarModel } from "../avatar/model";
import { translate } from "../i18n/translator";
import type { PerformerSelection } from "../input/performer-selection";
import type { PerformerFactory } from "../stage/puppet/performer-group";
import type { Stage } from "../stage/stage";
import type { FileStore } from "../storage/file-store";
import type { WebStorage } from "../storage/web-storage";
import type { AvatarChooser } from "../ui/library/avatar-chooser";
import type { LibraryPanel } from "../ui/library/library-panel";
import type { ShowToast } from "../ui/notification/toast";
import { MAX_PERFORMERS } from "../wire/limbs";

/** Where the file is kept, and whether it dances; of dancers behind the first with their number from 1. */
const AVATAR_FILE_KEY = "avatar";
const AVATAR_ACTIVE_KEY = "bunraku.avatar";

export interface AvatarSlotOptions {
  page: {
    readonly library: Pick<LibraryPanel, "problem"> & { readonly danceAs: AvatarChooser };
    readonly toast: ShowToast;
  };
  files: Pick<FileStore, "get" | "put" | "remove">;
  preferences: Pick<WebStorage, "get" | "put" | "remove">;
}

export class AvatarSlot {
  #stage: Pick<Stage, "setPerformerFactory"> | null = null;
  #model: AvatarModel | null = null;
  /** Makes the avatar of the model for a dancer's lengths. */
  #factory: PerformerFactory | null = null;
  /** The same while it dances; null while the puppet does. */
  #activeFactory: PerformerFactory | null = null;
  /** The file that is being read; a later one makes it stale. */
  #pendingFile: File | null = null;

  #restored = false;
  readonly #fileKey: string;
  readonly #activeKey: string;

  /** In the place of a performer, by number. */
  constructor(
    private readonly options: AvatarSlotOptions,
    private readonly performer = 0,
  ) {
    const own = performer > 0 ? `.${performer + 1}` : "";
    [this.#fileKey, this.#activeKey] = [AVATAR_FILE_KEY + own, AVATAR_ACTIVE_KEY + own];
    this.#render();
  }

  /** The stage it is about, once there is one. */
  set stage(stage: Pick<Stage, "setPerformerFactory">) {
    this.#stage = stage;
    if (this.#activeFactory) stage.setPerformerFactory(this.#activeFactory, this.performer);
  }

  /** Brings back the avatar of the last visit, if there was one; once. */
  async restore(): Promise<void> {
    if (this.#restored) return;
    this.#restored = true;
    const { files, preferences: choices } = this.options;
    const dancing = choices.get(this.#activeKey);
    if (dancing === null) return;
    const file = await files.get(this.#fileKey);
    if (!file || this.#pendingFile || this.#model) return;
    await this.#loadModel(file, dancing === "yes");
  }

  /** Dances as what is in a file from now on, and at the next visit; tells why where it cannot. */
  async load(file: File): Promise<void> {
    if (!(await this.#loadModel(file, true))) return;
    const { page, files, preferences: choices } = this.options;
    choices.put(this.#activeKey, "yes");
    const kept = await files.put(this.#fileKey, file);
    const name = this.#model?.name ?? file.name;
    page.toast(
      kept
        ? translate("{name} dances here; everyone else sees the puppet", { name })
        : translate("{name} dances here; everyone else sees the puppet. This browser keeps it for this visit only", {
            name,
          }),
    );
  }

  /** The avatar dances, or the puppet does. */
  setActive(active: boolean): void {
    if (!this.#model) return;
    this.options.preferences.put(this.#activeKey, active ? "yes" : "no");
    this.#applyActive(active);
  }

  /** Forgets the avatar, also for the next visit. */
  async remove(): Promise<void> {
    this.#pendingFile = null;
    this.#disposeModel();
    this.options.preferences.remove(this.#activeKey);
    await this.options.files.remove(this.#fileKey);
  }

  async #loadModel(file: File, active: boolean): Promise<boolean> {
    const { page } = this.options;
    this.#pendingFile = file;
    this.#render();
    try {
      if (file.size > MAX_FILE_BYTES) throw fileTooLarge(file.size);
      const [{ Avatar, AvatarModel }, bytes] = await Promise.all([import("./avatar-chunk"), file.arrayBuffer()]);
      const model = await AvatarModel.parse(bytes, file.name.replace(/\.\w+$/, ""));
      if (this.#pendingFile !== file) {
        model.dispose();
        return false;
      }
      this.#disposeModel();
      this.#model = model;
      this.#factory = (figure) => new Avatar(model, figure);
      this.#pendingFile = null;
      this.#applyActive(active);
      return true;
    } catch (error) {
      if (this.#pendingFile !== file) return false;
      this.#pendingFile = null;
      this.#render();
      const known = error instanceof AvatarError;
      page.library.problem(
        file.name,
        known ? error.title : translate("It could not be read"),
        known ? error.detail : translate("the file or what reads it did not come"),
        known ? error.hint : translate("Try again when the line is back."),
      );
      return false;
    }
  }

  #applyActive(active: boolean): void {
    this.#activeFactory = active ? this.#factory : null;
    this.#stage?.setPerformerFactory(this.#activeFactory, this.performer);
    this.#render();
  }

  /** The puppet dances, and the model is no more. */
  #disposeModel(): void {
    if (this.#activeFactory) this.#stage?.setPerformerFactory(null, this.performer);
    this.#activeFactory = this.#factory = null;
    this.#model?.dispose();
    this.#model = null;
    this.#render();
  }

  #render(): void {
    this.options.page.library.danceAs.render(this.performer, {
      name: this.#model?.name ?? null,
      active: this.#activeFactory !== null,
      loadingFile: this.#pendingFile?.name ?? null,
    });
  }
}

/** Who dances in the places of all the dancers that there may be. */
export class AvatarSlots {
  readonly #slots: readonly AvatarSlot[];

  /** The person brings avatars for the `choice`'s performer. */
  constructor(
    options: AvatarSlotOptions,
    private readonly selectedPerformer: Pick<PerformerSelection, "performer">,
  ) {
    this.#slots = Array.from({ length: MAX_PERFORMERS }, (_, performer) => new AvatarSlot(options, performer));
  }

  /** In the place of the chosen dancer. */
  get selected(): AvatarSlot {
    return this.#slots[this.selectedPerformer.performer];
  }

  /** The stage they are about, once there is one. */
  set stage(stage: Pick<Stage, "setPerformerFactory">) {
    for (const casting of this.#slots) casting.stage = stage;
  }

  /** Brings back the avatars of the last visit for so many dancers: those of others are not read before they are seen. */
  restore(performerCount: number): void {
    for (const casting of this.#slots.slice(0, performerCount)) void casting.restore();
  }
}
