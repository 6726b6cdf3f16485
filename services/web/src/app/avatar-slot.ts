/**
 * Avatars that replace the puppet on this page. An avatar's file is stored in this browser and never sent anywhere;
 * all other viewers see the puppet.
 */

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

/** Storage keys of an avatar's file and of whether it is shown. Performers after the first append `.2`, `.3`, ... */
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

/** Avatar of one performer. */
export class AvatarSlot {
  #stage: Pick<Stage, "setPerformerFactory"> | null = null;
  #model: AvatarModel | null = null;
  /** Fits the model to a performer's figure. */
  #factory: PerformerFactory | null = null;
  /** `#factory` while the avatar is shown; null while the puppet is. */
  #activeFactory: PerformerFactory | null = null;
  /** File that is being loaded. A file chosen later replaces it. */
  #pendingFile: File | null = null;

  #restored = false;
  readonly #fileKey: string;
  readonly #activeKey: string;

  constructor(
    private readonly options: AvatarSlotOptions,
    private readonly performer = 0,
  ) {
    const suffix = performer > 0 ? `.${performer + 1}` : "";
    [this.#fileKey, this.#activeKey] = [AVATAR_FILE_KEY + suffix, AVATAR_ACTIVE_KEY + suffix];
    this.#render();
  }

  /** Set the stage once it is ready. */
  set stage(stage: Pick<Stage, "setPerformerFactory">) {
    this.#stage = stage;
    if (this.#activeFactory) stage.setPerformerFactory(this.#activeFactory, this.performer);
  }

  /** Load the avatar of the last visit, if there was one. Later calls do nothing. */
  async restore(): Promise<void> {
    if (this.#restored) return;
    this.#restored = true;
    const { files, preferences } = this.options;
    const active = preferences.get(this.#activeKey);
    if (active === null) return;
    const file = await files.get(this.#fileKey);
    if (!file || this.#pendingFile || this.#model) return;
    await this.#loadModel(file, active === "yes");
  }

  /** Show an avatar file instead of the puppet, now and at the next visit. Reports a file that cannot be used. */
  async load(file: File): Promise<void> {
    if (!(await this.#loadModel(file, true))) return;
    const { page, files, preferences } = this.options;
    preferences.put(this.#activeKey, "yes");
    const isStored = await files.put(this.#fileKey, file);
    const name = this.#model?.name ?? file.name;
    page.toast(
      isStored
        ? translate("{name} dances here; everyone else sees the puppet", { name })
        : translate(
            "{name} dances here, for this visit only: this browser cannot store it. Everyone else sees the puppet",
            {
              name,
            },
          ),
    );
  }

  /** Show the avatar, or the puppet. */
  setActive(active: boolean): void {
    if (!this.#model) return;
    this.options.preferences.put(this.#activeKey, active ? "yes" : "no");
    this.#applyActive(active);
  }

  /** Remove the avatar, also from the browser's storage. */
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
      const isKnown = error instanceof AvatarError;
      page.library.problem(
        file.name,
        isKnown ? error.title : translate("It could not be read"),
        isKnown ? error.detail : translate("the file or the program that reads it could not be loaded"),
        isKnown ? error.hint : translate("Check your connection, then try again."),
      );
      return false;
    }
  }

  #applyActive(active: boolean): void {
    this.#activeFactory = active ? this.#factory : null;
    this.#stage?.setPerformerFactory(this.#activeFactory, this.performer);
    this.#render();
  }

  /** Show the puppet and free the model. */
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

/** Avatars of all performers. */
export class AvatarSlots {
  readonly #slots: readonly AvatarSlot[];

  /** A chosen file applies to the performer that `selectedPerformer` names. */
  constructor(
    options: AvatarSlotOptions,
    private readonly selectedPerformer: Pick<PerformerSelection, "performer">,
  ) {
    this.#slots = Array.from({ length: MAX_PERFORMERS }, (_, performer) => new AvatarSlot(options, performer));
  }

  /** Slot of the selected performer. */
  get selected(): AvatarSlot {
    return this.#slots[this.selectedPerformer.performer];
  }

  /** Set the stage once it is ready. */
  set stage(stage: Pick<Stage, "setPerformerFactory">) {
    for (const slot of this.#slots) slot.stage = stage;
  }

  /** Load the avatars of the last visit for the first `performerCount` performers. */
  restore(performerCount: number): void {
    for (const slot of this.#slots.slice(0, performerCount)) void slot.restore();
  }
}
