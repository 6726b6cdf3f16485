/** A headset that is emulated in a page, with controllers and tracked hands (`iwer`). */
import { fileURLToPath } from "node:url";
import type { XRDevice } from "iwer";
import type { Page } from "playwright-core";
import type { Mesh } from "three";
import type { ImmersiveSession } from "../../src/immersive/immersive-session";
import type { HandGrip } from "../../src/input/hand";
import type { Position } from "./page-probe";

type Side = "left" | "right";

interface HeadsetWindow {
  IWER: typeof import("iwer");
  headset: XRDevice;
  bunraku: { immersive: ImmersiveSession | null };
}

/** Connect a headset to a page, before its scripts. */
export async function connectHeadset(page: Page): Promise<void> {
  await page.addInitScript({ path: fileURLToPath(import.meta.resolve("iwer/build/iwer.min.js")) });
  await page.addInitScript(() => {
    const scope = globalThis as unknown as HeadsetWindow;
    scope.headset = new scope.IWER.XRDevice(scope.IWER.metaQuest3);
    scope.headset.installRuntime({ forceInstall: true });
  });
}

/** Enter VR by its button, and wait for the first frame with a performer. */
export async function enterVr(page: Page): Promise<void> {
  await page.getByRole("button", { name: "Enter VR" }).click();
  await page.waitForFunction(() => (globalThis as unknown as HeadsetWindow).bunraku.immersive?.ringInRoom(0) ?? false);
}

/** Leave VR as by the system's menu. */
export async function leaveVr(page: Page): Promise<void> {
  await page.evaluate(() => (globalThis as unknown as HeadsetWindow).headset.activeSession?.end());
  await page.getByRole("button", { name: "Enter VR" }).waitFor();
}

/** Return the position of a limb's ring in the room. */
export function ringInRoom(page: Page, limb: number): Promise<Position> {
  return page.evaluate(
    (limb) => (globalThis as unknown as HeadsetWindow).bunraku.immersive?.ringInRoom(limb)?.toArray() as Position,
    limb,
  );
}

/** Move a controller or a tracked hand, whichever the headset follows. */
export async function moveHand(page: Page, side: Side, at: Position): Promise<void> {
  await page.evaluate(
    ({ side, at }) => {
      const { headset } = globalThis as unknown as HeadsetWindow;
      for (const input of [headset.controllers[side], headset.hands[side]]) input?.position.set(...at);
    },
    { side, at },
  );
}

/** Use tracked hands in place of controllers. */
export async function trackHands(page: Page): Promise<void> {
  await page.evaluate(() => void ((globalThis as unknown as HeadsetWindow).headset.primaryInputMode = "hand"));
}

/** Press or release a button of a controller. */
export async function setButton(page: Page, side: Side, button: string, value: number): Promise<void> {
  await page.evaluate(
    ({ side, button, value }) =>
      (globalThis as unknown as HeadsetWindow).headset.controllers[side]?.updateButtonValue(button, value),
    { side, button, value },
  );
}

/** Push the thumbstick of a controller to the left (-1) or right (1). */
export async function turnThumbstick(page: Page, side: Side, x: number): Promise<void> {
  await page.evaluate(
    ({ side, x }) =>
      (globalThis as unknown as HeadsetWindow).headset.controllers[side]?.updateAxis("thumbstick", "x-axis", x),
    { side, x },
  );
}

/** Pinch with a tracked hand, 0 (open) to 1. */
export async function pinch(page: Page, side: Side, value: number): Promise<void> {
  await page.evaluate(
    ({ side, value }) => (globalThis as unknown as HeadsetWindow).headset.hands[side]?.updatePinchValue(value),
    { side, value },
  );
}

/** Wait until a hand does something, perhaps with a limb. */
export async function waitForGrip(page: Page, side: Side, kind: HandGrip["kind"], limb?: number): Promise<void> {
  await page.waitForFunction(
    ({ side, kind, limb }) =>
      (globalThis as unknown as HeadsetWindow).bunraku.immersive?.grips.some(
        (grip) => grip.name === side && grip.kind === kind && (limb === undefined || grip.limb === limb),
      ),
    { side, kind, limb },
  );
}

/** Show or hide a menu of the system over the stage. */
export async function showMenu(page: Page, isShown: boolean): Promise<void> {
  await page.evaluate(
    (isShown) =>
      (globalThis as unknown as HeadsetWindow).headset.updateVisibilityState(
        (isShown ? "visible-blurred" : "visible") as XRVisibilityState,
      ),
    isShown,
  );
}

/**
 * Report the loss of the graphics to the headset's stage, as browsers do when their graphics process ends. They are not
 * taken away: the emulator reads them in a frame that may come before the report.
 */
export async function reportGraphicsLoss(page: Page): Promise<void> {
  await page.evaluate(() =>
    document.querySelector("[data-webxr_runtime] canvas")?.dispatchEvent(new Event("webglcontextlost")),
  );
}

/** Wait until an avatar replaces the first puppet in VR. */
export async function waitForAvatar(page: Page): Promise<void> {
  await page.waitForFunction(() => {
    const { immersive } = (globalThis as unknown as HeadsetWindow).bunraku;
    const group = immersive?.stage.scene.getObjectByName("performers")?.children[0];
    return group?.visible && !group.getObjectByName("figure");
  });
}

/** Let the page's thread, before its scripts, believe that a graphics processor draws. */
export async function pretendGraphicsProcessor(page: Page): Promise<void> {
  await page.addInitScript(() => {
    const UNMASKED_RENDERER_WEBGL = 0x9246;
    const { getParameter } = WebGL2RenderingContext.prototype;
    WebGL2RenderingContext.prototype.getParameter = function (name: number): unknown {
      return name === UNMASKED_RENDERER_WEBGL ? "A graphics processor" : getParameter.call(this, name);
    };
  });
}

/** Return the material of the first puppet in VR, and the number of invalid shader programs. */
export function readMaterial(page: Page): Promise<{ type: string; invalidPrograms: number }> {
  return page.evaluate(() => {
    const { stage } = (globalThis as unknown as HeadsetWindow).bunraku.immersive as ImmersiveSession;
    const figure = stage.scene.getObjectByName("figure") as Mesh;
    const gl = stage.renderer.getContext();
    const programs = (stage.renderer.info.programs ?? []).map(({ program }) => program as WebGLProgram);
    const invalid = programs.filter((program) => !gl.getProgramParameter(program, gl.LINK_STATUS));
    return { type: [figure.material].flat()[0].type, invalidPrograms: invalid.length };
  });
}
