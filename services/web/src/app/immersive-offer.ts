/** Loads VR where the browser has a headset, now or once one is connected. Other pages load nothing of it. */

/** Call `load` whenever there is a headset for VR: at once, and after each change of the devices. */
export function watchForHeadset(
  load: () => void,
  system: Pick<XRSystem, "isSessionSupported" | "addEventListener"> | undefined = navigator.xr,
): void {
  const check = async () => {
    if (await system?.isSessionSupported("immersive-vr").catch(() => false)) load();
  };
  system?.addEventListener("devicechange", () => void check());
  void check();
}
