/**
 * Avatars that replace the puppet on this page. An avatar's file is stored in this browser and never sent anywhere;
 * all other viewers see the puppet.
 */

import { AvatarError, fileTooLarge, MAX_FILE_BYTES } from "../avatar/error";
import { translate } from "../i18n/translator";
import type { FileStore } from "../storage/file-store";
import type { WebStorage } from "../storage/web-storage";
import type { AvatarChooser } from "../ui/library/avatar-chooser";
import type { LibraryPanel } from "../ui/library/library-panel";
import type { ShowToast } from "../ui/notification/toast";
import { MAX_PERFORMERS } from "../wire/limbs";

/** Storage keys of an avatar's file and of whether it is shown. Performers after the first append `.2`, `.3`, ... */
const AVATAR_FILE_KEY = "avatar";
const AVATAR_ACTIVE_KEY = "bunraku.avatar";

/** Avatars on the stage, by performer. */
export interface StagedAvatars {
  /**
   * Load an avatar, which is then ready to be shown. Return its name, or null if a later request replaced this one.
   *
   * @throws AvatarError if the file cannot be used
   */
  load(performer: number, file: File): Promise<string | null>;
  /** Show the avatar, or the puppet. */
  setActive(performer: number, active: boolean): void;
  remove(performer: number): void;
}

export interface AvatarSlotOptions {
  page: {
    readonly library: Pick<LibraryPanel, "problem"> & { readonly danceAs: AvatarChooser };
    readonly toast: ShowToast;
  };
  avatars: StagedAvatars;
  files: Pick<FileStore, "get" | "put" | "remove">;
  preferences: Pick<WebStorage, "get" | "put" | "remove">;
}

/** Avatar of one performer. */
export class AvatarSlot {
  /** Name of the loaded avatar, null for none. */
  #name: string | null = null;
  #isActive = false;
  /** File of the loaded avatar. */
  #file: File | null = null;
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

  /** File of the avatar that is shown, null if the puppet is. */
  get activeFile(): File | null {
    return this.#isActive ? this.#file : null;
  }

  /** Load the avatar of the last visit, if there was one. Later calls do nothing. */
  async restore(): Promise<void> {
    if (this.#restored) return;
    this.#restored = true;
    const { files, preferences } = this.options;
    const active = preferences.get(this.#activeKey);
    if (active === null) return;
    const file = await files.get(this.#fileKey);
    if (!file || this.#pendingFile || this.#name !== null) return;
    await this.#loadModel(file, active === "yes");
  }

  /** Show an avatar file instead of the puppet, now and at the next visit. Reports a file that cannot be used. */
  async load(file: File): Promise<void> {
    if (!(await this.#loadModel(file, true))) return;
    const { page, files, preferences } = this.options;
    preferences.put(this.#activeKey, "yes");
    const isStored = await files.put(this.#fileKey, file);
    const name = this.#name ?? file.name;
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
    if (this.#name === null) return;
    this.options.preferences.put(this.#activeKey, active ? "yes" : "no");
    this.#applyActive(active);
  }

  /** Remove the avatar, also from the browser's storage. */
  async remove(): Promise<void> {
    this.#pendingFile = this.#name = this.#file = null;
    this.#isActive = false;
    this.options.avatars.remove(this.performer);
    this.#render();
    this.options.preferences.remove(this.#activeKey);
    await this.options.files.remove(this.#fileKey);
  }

  async #loadModel(file: File, active: boolean): Promise<boolean> {
    const { page } = this.options;
    this.#pendingFile = file;
    this.#render();
    try {
      if (file.size > MAX_FILE_BYTES) throw fileTooLarge(file.size);
      const name = await this.options.avatars.load(this.performer, file);
      if (this.#pendingFile !== file || name === null) return false;
      this.#name = name;
      this.#file = file;
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
    this.#isActive = active;
    this.options.avatars.setActive(this.performer, active);
    this.#render();
  }

  #render(): void {
    this.options.page.library.danceAs.render(this.performer, {
      name: this.#name,
      active: this.#isActive,
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
    private readonly selectedPerformer: { readonly performer: number },
  ) {
    this.#slots = Array.from({ length: MAX_PERFORMERS }, (_, performer) => new AvatarSlot(options, performer));
  }

  /** Slot of the selected performer. */
  get selected(): AvatarSlot {
    return this.#slots[this.selectedPerformer.performer];
  }

  /** Files of the avatars that are shown, by performer; null where the puppet is. */
  get activeFiles(): (File | null)[] {
    return this.#slots.map(({ activeFile }) => activeFile);
  }

  /** Load the avatars of the last visit for the first `performerCount` performers. */
  restore(performerCount: number): void {
    for (const slot of this.#slots.slice(0, performerCount)) void slot.restore();
  }
}
