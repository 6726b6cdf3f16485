/** Button that starts to control the hands by camera, or the reason why there is none. */
import { translate } from "../../i18n/translator";
import { element, setText } from "../dom";
import { icon } from "../icon";

/** Whether this page may use a camera; if not, whether HTTPS would help. */
export type CameraSupport = "available" | "needs HTTPS" | "unavailable";

/** Return whether a page may use a camera. Browsers offer `mediaDevices` to secure pages only. */
export function cameraSupport(
  mediaDevices: Partial<Pick<MediaDevices, "getUserMedia">> | undefined,
  isSecure: boolean,
): CameraSupport {
  if (typeof mediaDevices?.getUserMedia === "function") return "available";
  return isSecure ? "unavailable" : "needs HTTPS";
}

/**
 * Create the button, or the reason in place of it. `toggle` switches the camera, tells whether it is on, and rejects if
 * its code cannot be loaded.
 */
export function createCameraButton(
  toggle: (onChange: (isOn: boolean) => void) => Promise<void>,
  support = cameraSupport(navigator.mediaDevices, isSecureContext),
): HTMLElement {
  const reason = element("p", { class: "strings-hint", role: "status", hidden: support === "unavailable" });
  if (support === "needs HTTPS") setText(reason, translate("Browsers allow the camera only on pages with HTTPS."));
  if (support !== "available") return reason;
  const label = element("span");
  const show = (isOn: boolean) => setText(label, translate(isOn ? "Stop the camera" : "Use my camera"));
  show(false);
  const onClick = () => {
    setText(reason, "");
    toggle(show).catch(() =>
      setText(reason, translate("The camera control could not be loaded. Check your connection, then try again")),
    );
  };
  const attributes = { class: "text-button camera-button", type: "button", onClick };
  return element("div", {}, element("button", attributes, icon("camera"), label), reason);
}
