/** Offers VR where the browser has it. A page without it loads nothing more than this module. */
import type { ClaimState } from "../engine/claim-controller";
import type { ImmersiveFrame } from "../engine/message";
import type { ImmersiveHost, ImmersiveMode } from "./immersive-mode";

export class ImmersiveOffer {
  /** Null while the browser has no VR. */
  #mode: ImmersiveMode | null = null;
  #isLoading = false;

  constructor(
    private readonly host: ImmersiveHost,
    private readonly system: Pick<XRSystem, "isSessionSupported" | "addEventListener"> | undefined = navigator.xr,
  ) {}

  /** True while VR shows the stage. */
  get isPresenting(): boolean {
    return this.#mode?.isPresenting ?? false;
  }

  /** Show the controls of VR where it is supported, now or once a headset is connected. */
  watch(): void {
    this.system?.addEventListener("devicechange", () => void this.#update());
    void this.#update();
  }

  onFrame(frame: ImmersiveFrame): void {
    this.#mode?.onFrame(frame);
  }

  /** Show a short message of the page in VR, too. */
  showMessage(text: string): void {
    this.#mode?.showMessage(text);
  }

  onLimbs(state: ClaimState): void {
    this.#mode?.onLimbs(state);
  }

  async #update(): Promise<void> {
    const isSupported = (await this.system?.isSessionSupported("immersive-vr").catch(() => false)) ?? false;
    if (isSupported && !this.#mode && !this.#isLoading) {
      this.#isLoading = true;
      // Without a connection there is no button; the next headset that is connected tries again.
      const chunk = await import("./immersive-mode").catch(() => null);
      this.#isLoading = false;
      if (chunk) this.#mode = new chunk.ImmersiveMode(this.host);
    }
    this.#mode?.setOffered(isSupported);
  }
}
