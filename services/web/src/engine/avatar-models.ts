/** Avatars that replace the puppet on the stage: loads their files, and shows them once the stage is ready. */
import type { AvatarModel } from "../avatar/model";
import type { PerformerFactory } from "../stage/puppet/performer-group";
import type { Stage } from "../stage/stage";

interface LoadedAvatar {
  readonly model: AvatarModel;
  /** Fits the model to a performer's figure. */
  readonly factory: PerformerFactory;
  isActive: boolean;
}

export class AvatarModels {
  #stage: Pick<Stage, "setPerformerFactory"> | null = null;
  /** Avatars by performer. */
  readonly #avatars = new Map<number, LoadedAvatar>();
  /** File that is being loaded, by performer. A later one replaces it. */
  readonly #pendingFiles = new Map<number, File>();

  /** Set the stage once it is ready. */
  set stage(stage: Pick<Stage, "setPerformerFactory">) {
    this.#stage = stage;
    for (const performer of this.#avatars.keys()) this.#apply(performer);
  }

  /**
   * Load the avatar of a performer, which is then ready to be shown. Return its name, or null if another file or a
   * removal replaced this one meanwhile. The previous avatar is replaced only if this one can be used.
   *
   * @throws AvatarError if the file cannot be used
   */
  async load(performer: number, file: File): Promise<string | null> {
    this.#pendingFiles.set(performer, file);
    try {
      const [{ Avatar, AvatarModel, nameOfFile }, bytes] = await Promise.all([
        import("./avatar-chunk"),
        file.arrayBuffer(),
      ]);
      const model = await AvatarModel.parse(bytes, nameOfFile(file.name));
      if (this.#pendingFiles.get(performer) !== file) {
        model.dispose();
        return null;
      }
      this.#dispose(performer);
      this.#avatars.set(performer, { model, factory: (figure) => new Avatar(model, figure), isActive: false });
      return model.name;
    } catch (error) {
      if (this.#pendingFiles.get(performer) !== file) return null;
      throw error;
    } finally {
      if (this.#pendingFiles.get(performer) === file) this.#pendingFiles.delete(performer);
    }
  }

  /** Show the avatar of a performer, or the puppet. Does nothing if no avatar is loaded. */
  setActive(performer: number, active: boolean): void {
    const avatar = this.#avatars.get(performer);
    if (!avatar) return;
    avatar.isActive = active;
    this.#apply(performer);
  }

  /** Show the puppet, and free the avatar of a performer. */
  remove(performer: number): void {
    this.#pendingFiles.delete(performer);
    this.#dispose(performer);
  }

  #apply(performer: number): void {
    const avatar = this.#avatars.get(performer);
    this.#stage?.setPerformerFactory(avatar?.isActive ? avatar.factory : null, performer);
  }

  #dispose(performer: number): void {
    const avatar = this.#avatars.get(performer);
    if (!avatar) return;
    this.#avatars.delete(performer);
    if (avatar.isActive) this.#apply(performer);
    avatar.model.dispose();
  }
}
