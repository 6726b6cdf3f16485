/** VR on the page: its controls, its session, and the messages between it and the engine. */
import type { ClaimState } from "../engine/claim-controller";
import type { EngineCommand, ImmersiveFrame } from "../engine/message";
import { type PlainMessageKey, translate } from "../i18n/translator";
import type { ImmersiveSession } from "../immersive/immersive-session";
import type { StageSize } from "../immersive/placement";
import type { Theme } from "../stage/scenery/look";
import { createImmersiveControls, type ImmersiveControls } from "../ui/immersive-controls";
import { limbName, performerCount } from "../ui/limb-state";
import type { ShowToast } from "../ui/notification/toast";

export interface ImmersiveHost {
  readonly page: { readonly toast: ShowToast; readonly header: { addControls(controls: HTMLElement): void } };
  send(command: EngineCommand): void;
  getTheme(): Theme;
  prefersReducedMotion(): boolean;
  /** Return the files of the avatars that replace puppets, by performer. */
  getAvatarFiles(): readonly (File | null)[];
  /** Called when VR has begun to show the stage, and when it has ended. */
  onPresenting(): void;
}

export class ImmersiveMode {
  readonly #controls: ImmersiveControls;
  #size: StageSize = "1:1";
  #session: XRSession | null = null;
  #view: ImmersiveSession | null = null;
  #isBusy = false;
  /** Limbs of this page that others asked for in the last state. */
  #requested: ReadonlySet<number> = new Set();

  constructor(private readonly host: ImmersiveHost) {
    this.#controls = createImmersiveControls({
      toggle: () => void (this.#session ? this.#session.end().catch(() => undefined) : this.#enter()),
      resize: () => this.#setSize(this.#size === "1:1" ? "1:4" : "1:1"),
    });
    host.page.header.addControls(this.#controls.element);
    this.#render();
  }

  get isPresenting(): boolean {
    return this.#view !== null;
  }

  /** Show the controls, or hide them as no headset is there any more. */
  setOffered(isOffered: boolean): void {
    this.#controls.element.hidden = !isOffered && !this.#session;
  }

  onFrame(frame: ImmersiveFrame): void {
    this.#view?.onFrame(frame);
  }

  showMessage(text: string): void {
    this.#view?.showMessage(text);
  }

  /** Tell the viewer who asks for a limb that the viewer holds. */
  onLimbs({ limbs }: ClaimState): void {
    const requested = limbs.flatMap(({ holder, requesters }, limb) =>
      holder?.mine && requesters.length > 0 ? limb : [],
    );
    for (const limb of requested) {
      if (this.#requested.has(limb)) continue;
      const names = { name: limbs[limb].requesters[0].name, limb: limbName(limb, performerCount(limbs)) };
      this.showMessage(translate("{name} asks for the {limb}", names));
    }
    this.#requested = new Set(requested);
  }

  async #enter(): Promise<void> {
    if (this.#isBusy || !navigator.xr) return;
    this.#setBusy(true);
    const chunk = import("../immersive/session-chunk");
    // Awaited only after the session, which the browser grants right after a click.
    chunk.catch(() => undefined);
    try {
      await this.#present(
        await navigator.xr
          .requestSession("immersive-vr", {
            requiredFeatures: ["local-floor"],
            optionalFeatures: ["hand-tracking", "layers"],
          })
          .catch((error: unknown) => this.#fail(REFUSED, error)),
        chunk,
      );
    } catch (error) {
      if (!(error instanceof EnterError)) throw error;
      console.warn(error.cause);
      this.host.page.toast(translate(error.text));
    } finally {
      this.#setBusy(false);
    }
  }

  /** Show the stage in `session`, until it ends. */
  async #present(session: XRSession, chunk: Promise<typeof import("../immersive/session-chunk")>): Promise<void> {
    this.#session = session;
    session.addEventListener("end", () => this.#onEnd());
    const { ImmersiveSession } = await chunk.catch((error: unknown) => this.#fail(NOT_LOADED, error));
    // It was left meanwhile.
    if (this.#session !== session) return;
    const { host } = this;
    try {
      this.#view = new ImmersiveSession(session, {
        theme: host.getTheme(),
        size: this.#size,
        reducedMotion: host.prefersReducedMotion(),
        avatarFiles: host.getAvatarFiles(),
        requestFrame: (hands) => host.send({ type: "immersive frame", hands }),
        selectNextPerformer: () => host.send({ type: "performer", performer: "next" }),
        onSize: (size) => this.#showSize(size),
        onGraphicsLost: () => host.page.toast(translate(GRAPHICS_LOST)),
      });
      this.#exposeDebugHandle();
      host.send({ type: "immersive", isPresenting: true });
      host.onPresenting();
      await this.#view.start();
    } catch (error) {
      this.#fail(REFUSED, error);
    }
    this.showMessage(translate("Close a hand on a ring to hold its string: trigger, squeeze or pinch"));
  }

  /** End the session, and throw the reason for the user. */
  #fail(text: PlainMessageKey, cause: unknown): never {
    void this.#session?.end().catch(() => undefined);
    throw new EnterError(text, cause);
  }

  #onEnd(): void {
    this.#session = null;
    if (this.#view) {
      this.#view = null;
      this.#exposeDebugHandle();
      this.host.send({ type: "immersive", isPresenting: false });
      this.host.onPresenting();
    }
    this.#render();
  }

  /** Add the session to `window.bunraku`, where tests and developers find the parts of the page. */
  #exposeDebugHandle(): void {
    const global = globalThis as { bunraku?: object };
    global.bunraku = { ...global.bunraku, immersive: this.#view };
  }

  #setSize(size: StageSize): void {
    this.#view?.setSize(size);
    this.#showSize(size);
  }

  #showSize(size: StageSize): void {
    this.#size = size;
    this.#render();
  }

  #setBusy(isBusy: boolean): void {
    this.#isBusy = isBusy;
    this.#render();
  }

  #render(): void {
    this.#controls.render({ isPresenting: this.#session !== null, isBusy: this.#isBusy, size: this.#size });
  }
}

const REFUSED = "VR could not start. Check that the headset is connected and that this site may use it";
const NOT_LOADED = "VR could not be loaded. Check your connection, then try again";
const GRAPHICS_LOST = "VR has ended, as the browser stopped its graphics. You can enter it again";

/** Reason why a session was not entered, as a text for the user. */
class EnterError extends Error {
  override readonly name = "EnterError";

  constructor(
    readonly text: PlainMessageKey,
    override readonly cause: unknown,
  ) {
    super(text);
  }
}
