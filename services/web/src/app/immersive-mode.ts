/** VR on the page: its controls, its session, and the messages between it and the engine. */
import type { ClaimState } from "../engine/claim-controller";
import type { EngineCommand, EngineEvent } from "../engine/message";
import { type PlainMessageKey, translate } from "../i18n/translator";
import type { ImmersiveSession } from "../immersive/immersive-session";
import type { StageSize } from "../immersive/placement";
import { createImmersiveControls, type ImmersiveControls } from "../ui/immersive-controls";
import { limbName, performerCount } from "../ui/limb-state";
import type { ShowToast } from "../ui/notification/toast";

/** Parts of the page that VR uses. */
export interface ImmersiveHost {
  readonly page: { readonly toast: ShowToast };
  readonly engine: { post(command: EngineCommand): void };
  readonly reducedMotion: { readonly matches: boolean };
  /** Return the files of the avatars that replace puppets, by performer. */
  getAvatarFiles(): readonly (File | null)[];
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
    this.#controls = createImmersiveControls(document, {
      toggle: () => void (this.#session ? this.#session.end().catch(() => undefined) : this.#enter()),
      resize: () => this.#setSize(this.#size === "1:1" ? "1:4" : "1:1"),
    });
    this.#render();
    // After the page has told the engine that nobody sees it.
    document.addEventListener("visibilitychange", () => this.#reportVisibility());
    const update = async () => this.#setOffered((await navigator.xr?.isSessionSupported("immersive-vr")) ?? false);
    navigator.xr?.addEventListener("devicechange", () => void update().catch(() => this.#setOffered(false)));
  }

  /** Handle an event of the engine, after the page. */
  onEvent(event: EngineEvent): void {
    if (event.type === "immersive") this.#view?.onFrame(event.frame);
    else if (event.type === "toast") this.#view?.showMessage(event.message);
    else if (event.type === "limbs") this.#showRequests(event.state);
  }

  /** Hide the controls while no headset is connected. */
  #setOffered(isOffered: boolean): void {
    this.#controls.isShown = isOffered || this.#session !== null;
  }

  /** Tell the viewer who asks for a limb that the viewer holds. */
  #showRequests({ limbs }: ClaimState): void {
    const requested = limbs.flatMap(({ holder, requesters }, limb) =>
      holder?.mine && requesters.length > 0 ? limb : [],
    );
    for (const limb of requested) {
      if (this.#requested.has(limb)) continue;
      const names = { name: limbs[limb].requesters[0].name, limb: limbName(limb, performerCount(limbs)) };
      this.#view?.showMessage(translate("{name} asks for the {limb}", names));
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
        theme: document.documentElement.dataset["theme"] === "day" ? "day" : "night",
        size: this.#size,
        reducedMotion: host.reducedMotion.matches,
        avatarFiles: host.getAvatarFiles(),
        requestFrame: (hands) => {
          // A frame after the end would begin another session in the engine.
          if (this.#session === session) host.engine.post({ type: "immersive", hands });
        },
        selectNextPerformer: () => host.engine.post({ type: "performer", performer: "next" }),
        onSize: (size) => this.#showSize(size),
        onGraphicsLost: () => host.page.toast(translate(GRAPHICS_LOST)),
      });
      this.#exposeDebugHandle();
      this.#reportVisibility();
      await this.#view.start();
    } catch (error) {
      this.#fail(REFUSED, error);
    }
    this.#view?.showMessage(translate("Close a hand on a ring to hold its string: trigger, squeeze or pinch"));
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
      this.host.engine.post({ type: "immersive", hands: null });
      this.#reportVisibility();
    }
    this.#render();
  }

  /** Tell the engine whether anybody sees the stage: in VR, or on the page. */
  #reportVisibility(): void {
    this.host.engine.post({ type: "set", settings: { isHidden: document.hidden && !this.#view } });
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
