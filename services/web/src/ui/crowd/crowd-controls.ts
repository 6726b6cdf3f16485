/** Controls in the strings panel that open limbs of the selected performer to the audience, and close them. */
import { translate } from "../../i18n/translator";
import { limbNumber } from "../../wire/limbs";
import { element, setAttribute, setText } from "../dom";
import { LIMB_NAMES, LIMB_ORDER, type LimbState } from "../limb-state";
import { type CrowdPolicy, POLICY_EFFECTS, POLICY_NAMES } from "./crowd-text";

/** Policy of each limb to open, by number; null closes it. */
export type CrowdEdit = Readonly<Record<number, CrowdPolicy | null>>;

export interface CrowdControls {
  readonly element: HTMLElement;
  /** Show the limbs of the `selected` performer. Unless `ready`, no limb can be opened. */
  render(limbs: readonly LimbState[], ready: boolean, selected: number): void;
}

export interface CrowdActions {
  /** Open limbs to the audience, and close them. */
  openLimbs(edit: CrowdEdit): void;
  /** Copy a link for the audience. */
  share(): void;
  /** Return a link for the audience; null if there is none, which was reported. */
  shareLink(): Promise<string | null>;
}

/** Create the controls. */
export function createCrowdControls(actions: CrowdActions): CrowdControls {
  const policies = Object.keys(POLICY_NAMES) as CrowdPolicy[];
  const options = policies.map((policy) => element("option", { value: policy }, translate(POLICY_NAMES[policy])));
  const chooser = element("select", { class: "text-field" }, ...options);
  const effect = element("small");
  const count = element("span", { class: "muted" });
  let performer = 0;
  let open: readonly number[] = [];
  const policy = () => chooser.value as CrowdPolicy;
  const writeEffect = () => setText(effect, translate(POLICY_EFFECTS[policy()]));
  const buttons = LIMB_ORDER.map((part) => {
    const onClick = () => {
      const limb = limbNumber(performer, part);
      actions.openLimbs({ [limb]: open.includes(limb) ? null : policy() });
    };
    return { part, button: element("button", { type: "button", onClick }, translate(LIMB_NAMES[part])) };
  });
  chooser.addEventListener("change", () => {
    writeEffect();
    if (open.length > 0) actions.openLimbs(Object.fromEntries(open.map((limb) => [limb, policy()])));
  });
  writeEffect();
  const details = element(
    "details",
    { class: "crowd strings-section" },
    element("summary", {}, translate("Let the audience pull"), count),
    element(
      "div",
      { class: "crowd-limbs", role: "group", "aria-label": translate("Open to the audience") },
      ...buttons.map(({ button }) => button),
    ),
    element("label", { class: "field" }, element("span", {}, translate("Many pulls become one by")), chooser),
    effect,
    element(
      "button",
      { class: "text-button", type: "button", onClick: actions.share },
      translate("Copy a link for the audience"),
    ),
    createQrToggle(actions.shareLink),
  );
  let wasOpen = false;
  return {
    element: details,
    render(limbs, ready, selected) {
      performer = selected;
      const policyOf = (part: number) => limbs[limbNumber(performer, part)].crowd?.policy;
      open = LIMB_ORDER.filter((part) => policyOf(part)).map((part) => limbNumber(performer, part));
      setText(count, open.length > 0 ? String(open.length) : "");
      for (const { part, button } of buttons) {
        setAttribute(button, "aria-pressed", String(policyOf(part) !== undefined));
        button.disabled = !ready;
      }
      chooser.disabled = !ready;
      const [current] = LIMB_ORDER.flatMap((part) => policyOf(part) ?? []);
      const known = policies.find((name) => name === current);
      if (known && document.activeElement !== chooser) chooser.value = known;
      writeEffect();
      // Shown when somebody opens a limb, and left as it is afterwards.
      if (open.length > 0 && !wasOpen) details.open = true;
      wasOpen = open.length > 0;
    },
  };
}

/** Create the button that shows and hides a QR code of the link. Each code has a new link. */
function createQrToggle(createLink: () => Promise<string | null>): HTMLElement {
  const place = element("div", { role: "status" });
  const toggle = element("button", { class: "text-button", type: "button", "aria-expanded": "false" });
  const show = (content: Node | string | null) => {
    place.replaceChildren(content ?? "");
    toggle.setAttribute("aria-expanded", String(content !== null));
    setText(toggle, translate(content === null ? "Show a QR code" : "Hide the QR code"));
  };
  show(null);
  toggle.addEventListener("click", () => {
    if (toggle.getAttribute("aria-expanded") === "true") show(null);
    else
      void Promise.all([import("./qr-picture"), createLink()]).then(
        ([{ createQrPicture }, link]) => {
          if (link === null) return;
          show(createQrPicture(link));
          place.scrollIntoView({ block: "nearest" });
        },
        () => show(translate("The QR code could not be loaded. Check your connection, then try again")),
      );
  });
  return element("div", {}, toggle, place);
}
