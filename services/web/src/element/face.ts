/** What stands in the element's shadow: the canvas, words, names over strings, and with controls a bar of buttons. */
import { createAsks, type Asks } from "../page/asks";
import { element, setAttribute } from "../page/dom";
import { icon, limbIcon } from "../page/icons";
import { createNextDancer } from "../page/dancer-chooser";
import { LIMB_ORDER, limbKey, limbName, performersOf, type LimbState } from "../page/model";
import { createSoundButton } from "../page/sound-control";
import { createTags, type Tags } from "../page/tags";
import { createToast, type Toasts } from "../page/toast";
import tokens from "../style/tokens.css?inline";
import { limbNumber } from "../wire/limbs";
import type { Speech } from "../words/say";
import own from "./element.css?inline";

/** Names keep so far from the element's upper edge, pixels. */
const TOP = 8;

export interface FaceActions {
  play(): void;
  toggle(limb: number): void;
  focus(limb: number | null): void;
  ask(limb: number): void;
  give(limb: number): void;
  nextDancer(): void;
  sound(): void;
}

export interface Face {
  /** What has the keys: the canvas, the buttons, and what of them is clicked. */
  readonly frame: HTMLElement;
  readonly canvas: HTMLCanvasElement;
  readonly tags: Tags;
  readonly asks: Asks;
  readonly toast: Toasts;
  /** Its button for sound. */
  readonly soundButton: HTMLElement;
  /** Words in place of the dance; null for none. */
  notice(title: string | null, text?: string): void;
  /** The bar: whether it is there; whether play may be pressed, and would pause; limbs, if they can be taken. */
  bar(shown: boolean, playing: boolean | null): void;
  /** The button for sound: whether there is any, and it is heard. */
  sound(there: boolean, heard: boolean): void;
  limbs(limbs: readonly LimbState[], hands: boolean, ready: boolean, chosen?: number): void;
  remove(): void;
}

/** The page's day, with the quotes that a build may leave out. */
const DAY = /:root\[data-theme=["']?day["']?\]/g;

let sheet: CSSStyleSheet | null = null;

/** One sheet for all elements. A sheet that is made so stands under any content security policy. */
function styles(): CSSStyleSheet {
  if (!sheet) {
    sheet = new CSSStyleSheet();
    sheet.replaceSync(tokens.replace(DAY, ':host([data-shown="day"])').replaceAll(":root", ":host") + own);
  }
  return sheet;
}

/** All that it says it says in `speech`. */
export function createFace(root: ShadowRoot, on: FaceActions, speech: Speech): Face {
  const { say } = speech;
  root.adoptedStyleSheets = [styles()];
  const canvas = element("canvas", { role: "img", "aria-label": say("A wooden puppet dancing on a stage before a disc of gold leaf") });
  const frame = element("div", { class: "frame", part: "frame", lang: speech.language, tabindex: -1 }, canvas, element("div", { class: "vignette" }));
  root.append(frame);
  const tags = createTags(frame, on.ask, TOP, undefined, speech);
  const notice = element("div", { class: "notice", part: "notice", role: "status", hidden: true });
  const messages = element("div", { class: "messages" });
  frame.append(notice, messages);
  const asks = createAsks(messages, on.give, speech);
  const toast = createToast(messages);
  const play = element("button", { class: "play", type: "button", "aria-label": say("Play"), onClick: on.play }, icon("play"));
  const sound = createSoundButton(on.sound, speech);
  sound.element.hidden = true;
  /** Whose limbs the buttons take. */
  let performer = 0;
  const discs = LIMB_ORDER.map((limb) => {
    const light = () => on.focus(limbNumber(performer, limb));
    const focus = { onFocus: light, onBlur: () => on.focus(null), onPointerenter: light, onPointerleave: () => on.focus(null) };
    return { limb, disc: element("button", { type: "button", hidden: true, onClick: () => on.toggle(limbNumber(performer, limb)), ...focus }, limbIcon(limb)) };
  });
  const next = createNextDancer(on.nextDancer, speech);
  const buttons = [play, sound.element, next.element, ...discs.map(({ disc }) => disc)];
  const bar = element("div", { class: "bar", part: "bar", role: "group", "aria-label": say("The stage"), hidden: true }, ...buttons);
  frame.append(bar);
  const counted = () => bar.style.setProperty("--count", String(buttons.filter((one) => !one.hidden).length));
  let shownPlaying: boolean | null = false;
  return {
    frame, canvas, tags, asks, toast, soundButton: sound.element,
    notice(title, text = "") {
      notice.hidden = title === null;
      if (title !== null) notice.replaceChildren(element("b", {}, title), text);
    },
    bar(shown, playing) {
      bar.hidden = !shown;
      play.hidden = playing === null;
      counted();
      if (playing === shownPlaying || playing === null) return;
      shownPlaying = playing;
      play.replaceChildren(icon(playing ? "pause" : "play"));
      play.setAttribute("aria-label", say(playing ? "Pause" : "Play"));
    },
    sound(there, heard) {
      sound.element.hidden = !there;
      sound.render(heard);
      counted();
    },
    limbs(limbs, hands, ready, chosen = 0) {
      performer = chosen;
      next.render(hands ? limbs : [], chosen);
      for (const { limb, disc } of discs) {
        const own = limbNumber(chosen, limb);
        const { holder } = limbs[own];
        const name = limbName(own, performersOf(limbs), speech);
        const capital = name.charAt(0).toUpperCase() + name.slice(1);
        disc.hidden = !hands;
        disc.disabled = !ready;
        setAttribute(disc, "data-mine", holder?.mine ?? false);
        disc.setAttribute("aria-label", !holder ? say("Take the {limb}", { limb: name }) : holder.mine ? say("Release the {limb}, held by you", { limb: name }) : say("{limb}, held by {name}", { limb: capital, name: holder.name }));
        disc.title = capital + say(", key {key}", { key: limbKey(limb) });
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
