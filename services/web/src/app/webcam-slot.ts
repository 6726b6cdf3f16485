/** Control by camera, whose code is loaded when the person first asks for it. */
import { translate } from "../i18n/translator";
import type { Page } from "../ui/page";
import type { LimbControls } from "./limb-controls";
import type { WebcamController } from "./webcam-controller";

export class WebcamSlot {
  #controller: WebcamController | null = null;
  #isLoading = false;

  constructor(
    private readonly page: Pick<Page, "strings" | "toast">,
    private readonly limbs: Pick<LimbControls, "moveBody">,
  ) {}

  /** Start the camera, or stop it. */
  toggle(): void {
    if (this.#controller) this.#controller.stop();
    else if (!this.#isLoading) void this.#start();
  }

  async #start(): Promise<void> {
    const { strings, toast } = this.page;
    this.#isLoading = true;
    try {
      const { WebcamController } = await import("./webcam-controller");
      strings.setCameraActive(true);
      this.#controller = new WebcamController({
        root: document.body,
        source: navigator.mediaDevices,
        move: (hands, now) => this.limbs.moveBody(hands, now),
        onStop: () => {
          this.#controller = null;
          strings.setCameraActive(false);
        },
        toast,
      });
    } catch {
      toast(translate("The camera control could not be loaded. Check your connection, then try again"));
    } finally {
      this.#isLoading = false;
    }
  }
}
