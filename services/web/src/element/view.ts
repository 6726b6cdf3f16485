/** What stands in the element's shadow: the canvas, words, names over strings, and with controls a bar of buttons. */

import type { Translator } from "../i18n/translator";
import tokens from "../style/tokens.css?inline";
import { element, setAttribute } from "../ui/dom";
import { icon, limbIcon } from "../ui/icon";
import { LIMB_ORDER, type LimbState, limbKey, limbName, performerCount } from "../ui/limb-state";
import { createToast, type ToastController } from "../ui/notification/toast";
import { createLimbRequests, type LimbRequests } from "../ui/strings/limb-request";
import { createNameTags, type NameTags } from "../ui/strings/name-tag";
import { createNextPerformerButton } from "../ui/strings/performer-chooser";
import { createSoundButton } from "../ui/transport/sound-control";
import { limbNumber } from "../wire/limbs";
import own from "./element.css?inline";

/** Names keep so far from the element's upper edge, pixels. */
const TAG_TOP_MARGIN_PX = 8;

export interface ElementViewActions {
  play(): void;
  toggle(limb: number): void;
  focus(limb: number | null): void;
  ask(limb: number): void;
  give(limb: number): void;
  nextDancer(): void;
  sound(): void;
}

export interface ElementView {
  /** What has the keys: the canvas, the buttons, and what of them is clicked. */
  readonly frame: HTMLElement;
  readonly canvas: HTMLCanvasElement;
  readonly nameTags: NameTags;
  readonly limbRequests: LimbRequests;
  readonly toast: ToastController;
  /** Its button for sound. */
  readonly soundButton: HTMLElement;
  /** Words in place of the dance; null for none. */
  notice(title: string | null, text?: string): void;
  /** The bar: whether it is there; whether play may be pressed, and would pause; limbs, if they can be taken. */
  setBar(shown: boolean, playing: boolean | null): void;
  /** The button for sound: whether there is any, and it is heard. */
  setSound(there: boolean, heard: boolean): void;
  renderLimbs(limbs: readonly LimbState[], hands: boolean, ready: boolean, chosen?: number): void;
  remove(): void;
}

/** The page's day, with the quotes that a build may leave out. */
const LIGHT_THEME_SELECTOR = /:root\[data-theme=["']?day["']?\]/g;

let styleSheet: CSSStyleSheet | null = null;

/** One sheet for all elements. A sheet that is made so stands under any content security policy. */
function sharedStyleSheet(): CSSStyleSheet {
  if (!styleSheet) {
    styleSheet = new CSSStyleSheet();
    styleSheet.replaceSync(
      tokens.replace(LIGHT_THEME_SELECTOR, ':host([data-shown="day"])').replaceAll(":root", ":host") + own,
    );
  }
  return styleSheet;
}

/** All that it says it says in `speech`. */
export function createElementView(root: ShadowRoot, actions: ElementViewActions, translator: Translator): ElementView {
  const { translate } = translator;
  root.adoptedStyleSheets = [sharedStyleSheet()];
  const canvas = element("canvas", {
    role: "img",
    "aria-label": translate("A wooden puppet dancing on a stage before a disc of gold leaf"),
  });
  const frame = element(
    "div",
    { class: "frame", part: "frame", lang: translator.language, tabindex: -1 },
    canvas,
    element("div", { class: "vignette" }),
  );
  root.append(frame);
  const tags = createNameTags(frame, actions.ask, TAG_TOP_MARGIN_PX, undefined, translator);
  const notice = element("div", { class: "notice", part: "notice", role: "status", hidden: true });
  const messages = element("div", { class: "messages" });
  frame.append(notice, messages);
  const asks = createLimbRequests(messages, actions.give, translator);
  const toast = createToast(messages);
  const play = element(
    "button",
    { class: "play", type: "button", "aria-label": translate("Play"), onClick: actions.play },
    icon("play"),
  );
  const sound = createSoundButton(actions.sound, translator);
  sound.element.hidden = true;
  /** Whose limbs the buttons take. */
  let performer = 0;
  const discs = LIMB_ORDER.map((limb) => {
    const light = () => actions.focus(limbNumber(performer, limb));
    const focus = {
      onFocus: light,
      onBlur: () => actions.focus(null),
      onPointerenter: light,
      onPointerleave: () => actions.focus(null),
    };
    return {
      limb,
      disc: element(
        "button",
        { type: "button", hidden: true, onClick: () => actions.toggle(limbNumber(performer, limb)), ...focus },
        limbIcon(limb),
      ),
    };
  });
  const next = createNextPerformerButton(actions.nextDancer, translator);
  const buttons = [play, sound.element, next.element, ...discs.map(({ disc }) => disc)];
  const bar = element(
    "div",
    { class: "bar", part: "bar", role: "group", "aria-label": translate("The stage"), hidden: true },
    ...buttons,
  );
  frame.append(bar);
  const counted = () => bar.style.setProperty("--count", String(buttons.filter((one) => !one.hidden).length));
  let shownPlaying: boolean | null = false;
  return {
    frame,
    canvas,
    nameTags: tags,
    limbRequests: asks,
    toast,
    soundButton: sound.element,
    notice(title, text = "") {
      notice.hidden = title === null;
      if (title !== null) notice.replaceChildren(element("b", {}, title), text);
    },
    setBar(shown, playing) {
      bar.hidden = !shown;
      play.hidden = playing === null;
      counted();
      if (playing === shownPlaying || playing === null) return;
      shownPlaying = playing;
      play.replaceChildren(icon(playing ? "pause" : "play"));
      play.setAttribute("aria-label", translate(playing ? "Pause" : "Play"));
    },
    setSound(there, heard) {
      sound.element.hidden = !there;
      sound.render(heard);
      counted();
    },
    renderLimbs(limbs, hands, ready, chosen = 0) {
      performer = chosen;
      next.render(hands ? limbs : [], chosen);
      for (const { limb, disc } of discs) {
        const own = limbNumber(chosen, limb);
        const { holder } = limbs[own];
        const name = limbName(own, performerCount(limbs), translator);
        const capital = name.charAt(0).toUpperCase() + name.slice(1);
        disc.hidden = !hands;
        disc.disabled = !ready;
        setAttribute(disc, "data-mine", holder?.mine ?? false);
        disc.setAttribute(
          "aria-label",
          !holder
            ? translate("Take the {limb}", { limb: name })
            : holder.mine
              ? translate("Release the {limb}, held by you", { limb: name })
              : translate("{limb}, held by {name}", { limb: capital, name: holder.name }),
        );
        disc.title = capital + translate(", key {key}", { key: limbKey(limb) });
        if (holder) disc.style.setProperty("--colour", `var(--holder-${holder.colour})`);
        else disc.style.removeProperty("--colour");
      }
      counted();
    },
    remove() {
      frame.remove();
    },
  };
}
