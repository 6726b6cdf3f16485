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

export interface CameraButton {
  readonly element: HTMLElement;
  /** Show whether the camera is on. */
  setActive(isActive: boolean): void;
}

export function createCameraButton(
  onClick: () => void,
  support = cameraSupport(navigator.mediaDevices, isSecureContext),
): CameraButton {
  if (support !== "available") {
    const reason = element("p", { class: "strings-hint", hidden: support === "unavailable" });
    if (support === "needs HTTPS") setText(reason, translate("Browsers allow the camera only on pages with HTTPS."));
    return { element: reason, setActive: () => undefined };
  }
  const label = element("span");
  const button = element(
    "button",
    { class: "text-button camera-button", type: "button", onClick },
    icon("camera"),
    label,
  );
  const setActive = (isActive: boolean) => setText(label, translate(isActive ? "Stop the camera" : "Use my camera"));
  setActive(false);
  return { element: button, setActive };
}
