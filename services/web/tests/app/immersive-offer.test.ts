import { expect, test, vi } from "vitest";
import { watchForHeadset } from "../../src/app/immersive-offer";

/** A system for VR whose headset can be connected. */
class System extends EventTarget {
  isConnected = false;
  isSessionSupported = vi.fn(() => Promise.resolve(this.isConnected));
  connect(isConnected: boolean): void {
    this.isConnected = isConnected;
    this.dispatchEvent(new Event("devicechange"));
  }
}

function watch(system?: System) {
  const load = vi.fn();
  watchForHeadset(load, system as unknown as XRSystem);
  return load;
}

test("a browser without WebXR loads nothing", async () => {
  const load = watch();
  await Promise.resolve();
  expect(load).not.toHaveBeenCalled();
});

test("VR is loaded once a headset is connected", async () => {
  const system = new System();
  const load = watch(system);
  await vi.waitFor(() => expect(system.isSessionSupported).toHaveBeenCalledWith("immersive-vr"));
  expect(load).not.toHaveBeenCalled();
  system.connect(true);
  await vi.waitFor(() => expect(load).toHaveBeenCalledTimes(1));
});

test("a browser that refuses to answer has no VR", async () => {
  const system = new System();
  system.isSessionSupported.mockRejectedValue(new DOMException("", "SecurityError"));
  const load = watch(system);
  await vi.waitFor(() => expect(system.isSessionSupported).toHaveBeenCalled());
  await Promise.resolve();
  expect(load).not.toHaveBeenCalled();
});
