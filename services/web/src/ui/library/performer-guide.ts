/** Section of the library for people who perform live: three steps from a motion capture tool to the stage. */
import { translate, translateToParts } from "../../i18n/translator";
import { element, setAttribute, setText } from "../dom";

/** Port at which the capture command listens to VMC. */
const VMC_PORT = 39539;
/** Command by which the operator of a server issues the token. */
const TOKEN_COMMAND = "bunraku token --role ingest";

/** Where a capture tool performs. */
export interface CaptureTarget {
  /** Id of the session on the stage; null for a new one. */
  readonly session: string | null;
  /** True if the server requires a token. */
  readonly needsToken: boolean;
}

/** Return the command that receives VMC and sends it to `target` of the server with this origin. */
export function captureCommand(server: string, { session, needsToken }: CaptureTarget): string {
  const parts = ["bunraku capture vmc", `--server ${server}`];
  if (session !== null) parts.push(`--session ${session}`);
  if (needsToken) parts.push("--token TOKEN");
  return parts.join(" ");
}

/**
 * Create the section of the library. Its button shows the steps to what `captureTarget` returns then, or hides them.
 */
export function createPerformerGuide(captureTarget: () => CaptureTarget): HTMLElement {
  const steps = element("div", { id: "performer-steps", hidden: true });
  const toggle = element(
    "button",
    { class: "text-button", type: "button", "aria-expanded": "false", "aria-controls": steps.id },
    translate("Become a performer"),
  );
  toggle.addEventListener("click", () => {
    const isOpening = steps.hidden === true;
    if (isOpening) steps.replaceChildren(createSteps(captureTarget()));
    steps.hidden = !isOpening;
    setAttribute(toggle, "aria-expanded", String(isOpening));
  });
  return element(
    "section",
    { class: "perform", "aria-labelledby": "perform" },
    element("h3", { id: "perform" }, translate("Perform live")),
    element(
      "p",
      { class: "muted" },
      translate(
        "Your own movement on this stage, from a motion capture tool. With a camera only: Strings, Use my camera.",
      ),
    ),
    toggle,
    steps,
  );
}

/** Create the list of steps. */
function createSteps(target: CaptureTarget): HTMLElement {
  const first = target.needsToken
    ? translateToParts("Ask whoever runs this server for a token that allows performing: {command}", {
        command: element("code", {}, TOKEN_COMMAND),
      })
    : [translate("This server asks for no token. Go to the computer on which your capture tool runs.")];
  const second = translateToParts("Install Bunraku there and start: {command}", {
    command: createCommand(captureCommand(location.origin, target)),
  });
  const third = translate(
    "Let your tool send VMC to port {port} of that computer. You are on the stage as soon as it sends; Ctrl-C ends it.",
    { port: String(VMC_PORT) },
  );
  return element(
    "ol",
    { class: "steps" },
    element("li", {}, ...first),
    element("li", {}, ...second),
    element("li", {}, third),
  );
}

/** Create a command with a button that copies it, where the browser allows that. */
function createCommand(command: string): HTMLElement {
  const code = element("code", { tabindex: "0" }, command);
  const box = element("span", { class: "command" }, code);
  const { clipboard } = navigator as { clipboard?: Clipboard };
  if (!clipboard) return box;
  const copy = element("button", { class: "text-button", type: "button" }, translate("Copy"));
  copy.addEventListener("click", () => {
    clipboard.writeText(command).then(
      () => setText(copy, translate("Copied")),
      // the text can still be selected by a click
      () => getSelection()?.selectAllChildren(code),
    );
  });
  box.append(copy);
  return box;
}
