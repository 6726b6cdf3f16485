/** Section of the library for those who may perform live. The steps are loaded when they are first shown. */
import { translate } from "../../i18n/translator";
import { element, setAttribute } from "../dom";
import type { CaptureTarget } from "./performer-guide";

export interface PerformerActions {
  /** Return where a capture tool performs. Omitted if this page may not perform. */
  captureTarget?(): CaptureTarget;
  /** Called if the steps cannot be loaded. */
  guideFailed(): void;
}

/** Create the section, or nothing for a page that may not perform. */
export function createPerformerSection({ captureTarget, guideFailed }: PerformerActions): HTMLElement[] {
  if (!captureTarget) return [];
  const steps = element("div", { id: "performer-steps", hidden: true });
  const show = async () => {
    const { createPerformerGuide } = await import("./performer-guide");
    steps.replaceChildren(createPerformerGuide(captureTarget()));
  };
  const setOpen = (open: boolean) => {
    steps.hidden = !open;
    setAttribute(toggle, "aria-expanded", String(open));
  };
  const toggle = element(
    "button",
    {
      class: "text-button",
      type: "button",
      "aria-expanded": "false",
      "aria-controls": steps.id,
      onClick: () => {
        setOpen(steps.hidden === true);
        if (steps.hidden) return;
        show().catch(() => {
          setOpen(false);
          guideFailed();
        });
      },
    },
    translate("Become a performer"),
  );
  const section = element(
    "section",
    { class: "perform", "aria-labelledby": "perform" },
    element("h3", { id: "perform" }, translate("Perform live")),
    element("p", { class: "muted" }, translate("Your own movement, from a motion capture tool, on this stage.")),
    toggle,
    steps,
  );
  return [section];
}
