/** Polling of gamepads: at every frame, but only while one is connected or the dialog of keys is open. */
import type { GamepadInput } from "../input/gamepad";
import type { MappingDialog } from "../ui/mapping/mapping-dialog";

export class GamepadPolling {
  #isPolling = false;

  constructor(
    private readonly gamepad: GamepadInput,
    private readonly dialog: Pick<MappingDialog, "isCapturing" | "isOpen" | "updateGamepad">,
  ) {}

  /** Start, as a gamepad was connected or the dialog was opened. Ends by itself when there is neither. */
  start(): void {
    if (!this.#isPolling) this.#poll();
  }

  #poll(): void {
    const { dialog, gamepad } = this;
    gamepad.update(performance.now(), !dialog.isCapturing);
    if (dialog.isOpen) dialog.updateGamepad(gamepad.pad);
    this.#isPolling = gamepad.pad !== null || dialog.isOpen;
    if (this.#isPolling) requestAnimationFrame(() => this.#poll());
  }
}
