/** Picture of a QR code. Loaded when it is asked for. */
import { translate } from "../../i18n/translator";
import { element, shape } from "../dom";
import { makeQrCode, type QrCode } from "./qr-code";

/** Light margin that scanners need, in modules. */
const QUIET_ZONE = 4;

/** Return whether only the machine itself reaches the address of a link. */
export function isLoopback(link: string): boolean {
  return /^(localhost|127\.[\d.]+|\[::1\])$/.test(new URL(link).hostname);
}

/** Draw the QR code of a link, dark on light in both themes, with a note if phones cannot reach it. */
export function createQrPicture(link: string): HTMLElement {
  const code = makeQrCode(link);
  const figure = element("figure", { class: "qr-code" });
  if (code) figure.append(drawCode(code));
  else figure.append(translate("Copy this link: {link}", { link }));
  if (isLoopback(link))
    figure.append(
      element(
        "figcaption",
        {},
        translate("Other devices do not reach this address. Start the server with --host 0.0.0.0."),
      ),
    );
  return figure;
}

function drawCode(code: QrCode): SVGSVGElement {
  const size = code.length + 2 * QUIET_ZONE;
  const dark = code.flatMap((row, y) =>
    row.flatMap((isDark, x) => (isDark ? `M${x + QUIET_ZONE} ${y + QUIET_ZONE}h1v1h-1z` : [])),
  );
  return shape(
    "svg",
    {
      viewBox: `0 0 ${size} ${size}`,
      role: "img",
      "aria-label": translate("QR code of the link for the audience"),
      "shape-rendering": "crispEdges",
    },
    shape("rect", { width: size, height: size, fill: "#fff" }),
    shape("path", { d: dark.join(""), fill: "#000" }),
  );
}
