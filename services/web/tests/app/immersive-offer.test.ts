import { afterEach, expect, test, vi } from "vitest";
import type { ImmersiveHost } from "../../src/app/immersive-mode";
import { ImmersiveOffer } from "../../src/app/immersive-offer";

/** States in which the mode was told to be offered; empty while it is not loaded. */
let offered: boolean[] = [];

vi.mock("../../src/app/immersive-mode", () => ({
  ImmersiveMode: class {
    isPresenting = true;
    setOffered(isOffered: boolean): void {
      offered.push(isOffered);
    }
  },
}));

afterEach(() => void (offered = []));

/** A system for VR whose headset can be connected. */
class System extends EventTarget {
  isConnected = false;
  isSessionSupported = vi.fn(() => Promise.resolve(this.isConnected));
  connect(isConnected: boolean): void {
    this.isConnected = isConnected;
    this.dispatchEvent(new Event("devicechange"));
  }
}

const watch = (system: System | undefined) => {
  const offer = new ImmersiveOffer({} as ImmersiveHost, system as unknown as XRSystem);
  offer.watch();
  return offer;
};

test("a browser without WebXR is offered nothing", async () => {
  const offer = watch(undefined);
  await Promise.resolve();
  expect([offered, offer.isPresenting]).toEqual([[], false]);
});

test("controls are shown once a headset is connected, and hidden without it", async () => {
  const system = new System();
  const offer = watch(system);
  await vi.waitFor(() => expect(system.isSessionSupported).toHaveBeenCalledWith("immersive-vr"));
  expect(offered).toEqual([]);
  system.connect(true);
  await vi.waitFor(() => expect(offered).toEqual([true]));
  expect(offer.isPresenting).toBe(true);
  system.connect(false);
  await vi.waitFor(() => expect(offered).toEqual([true, false]));
});

test("a browser that refuses to answer has no VR", async () => {
  const system = new System();
  system.isSessionSupported.mockRejectedValue(new DOMException("", "SecurityError"));
  watch(system);
  await vi.waitFor(() => expect(system.isSessionSupported).toHaveBeenCalled());
  expect(offered).toEqual([]);
});
