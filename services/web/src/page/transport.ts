/** Play, seek, loop, sound, picture, keep, and the three panels' buttons. */
import { element, setAttribute, setText } from "./dom";
import { clockTime } from "./format";
import { icon, type IconName } from "./icons";
import { createSeek } from "./seek";
import { createSoundControl, type SoundActions, type SoundControl } from "./sound-control";
import { say, type Plain } from "../words/say";

export type PanelName = "library" | "strings" | "line";
export type Health = "good" | "poor" | "lost" | "none";

export interface Transport {
  /** What of it stands before the picture: on a phone some of its buttons are beside it. */
  readonly parts: readonly HTMLElement[];
  readonly sound: SoundControl;
  timeline(playing: boolean, loop: boolean, ready: boolean): void;
  position(seconds: number, duration: number): void;
  blocks(blocks: ArrayLike<number>, rates: number): void;
  expanded(panel: PanelName, open: boolean): void;
  health(health: Health): void;
  /** Keeps what is on the stage, as its button does. */
  keep(): void;
  /** Whether the dance has a camera of its own, the show's, and whether that is followed. */
  camera(there: boolean, followed: boolean): void;
}

const PANELS: readonly { name: PanelName; label: Plain; icon: IconName }[] = [
  { name: "library", label: "Library", icon: "library" },
  { name: "strings", label: "Strings", icon: "strings" },
  { name: "line", label: "Line", icon: "line" },
];
const KEEP = "Keep this";
const KEEPING = "Keeping";
const HEALTH: Readonly<Record<Health, Plain>> = { good: "good", poor: "short of data", lost: "not connected", none: "no dance yet" };

export interface TransportActions extends SoundActions {
  play(): void;
  loop(): void;
  seek(seconds: number): void;
  panel(panel: PanelName): void;
  /** Follows the show's camera, or no longer. */
  camera(): void;
  /** Saves a picture of the stage. */
  picture(): void;
  /** Keeps the performance as a new motion; done, or given up and told why, when it resolves. Left out, it cannot be kept here. */
  keep?(): Promise<void>;
}

export function createTransport(root: HTMLElement, on: TransportActions): Transport {
  const play = element("button", { class: "play", type: "button", disabled: true, onClick: on.play }, icon("play"));
  const [now, end] = [element("span"), element("span")];
  const seek = createSeek(on.seek);
  const loop = element("button", { class: "round-button loop", type: "button", "aria-label": say("Loop"), onClick: on.loop }, icon("loop"));
  const camera = element("button", { class: "round-button camera", type: "button", "aria-label": say("Show's camera"), hidden: true, onClick: on.camera }, icon("camera"));
  const picture = element("button", { class: "round-button picture", type: "button", "aria-label": say("Save a picture"), onClick: on.picture }, icon("picture"));
  const sound = createSoundControl(on);
  const keepName = element("span", {}, say(KEEP));
  const keep = element("button", { class: "pill keep", type: "button", "aria-label": say(KEEP), disabled: true, hidden: !on.keep, onClick: () => void keepNow() }, icon("keep"), keepName);
  let ready = false;
  let keeping = false;
  const showKeep = () => {
    keep.disabled = !ready;
    setAttribute(keep, "aria-busy", keeping);
    setText(keepName, say(keeping ? KEEPING : KEEP));
    keep.setAttribute("aria-label", say(keeping ? KEEPING : KEEP));
  };
  const keepNow = async () => {
    if (!ready || keeping || !on.keep) return;
    keeping = true;
    showKeep();
    try {
      await on.keep();
    } finally {
      keeping = false;
      showKeep();
    }
  };
  const dot = element("span", { class: "health", role: "img" });
  const pills = new Map(
    PANELS.map(({ name, label: english, icon: glyph }) => {
      const label = say(english);
      const pill = element("button", { class: "pill", type: "button", "data-panel": name, "aria-label": label, "aria-expanded": "false", onClick: () => on.panel(name) });
      pill.append(icon(glyph), element("span", {}, label));
      if (name === "line") pill.append(dot);
      return [name, pill] as const;
    }),
  );
  const tools = element("div", { class: "tools" }, loop, camera, sound.element, picture, keep, element("span", { class: "tools-rule" }), ...pills.values());
  const area = element("div", { class: "seek-area" }, element("div", { class: "times" }, now, end), seek.element);
  const bar = element("section", { class: "transport", "aria-label": say("Transport") }, play, area, tools);
  root.append(bar);
  let shown = "";
  return {
    parts: [bar, camera, picture, sound.element],
    sound,
    timeline(playing, looping, known) {
      ready = known;
      play.disabled = !ready;
      showKeep();
      const state = say(playing ? "Pause" : "Play");
      setAttribute(loop, "aria-pressed", String(looping));
      if (shown === state) return;
      shown = state;
      play.setAttribute("aria-label", state);
      play.replaceChildren(icon(playing ? "pause" : "play"));
    },
    position(seconds, duration) {
      setText(now, clockTime(seconds));
      setText(end, clockTime(duration));
      seek.position(seconds, duration);
    },
    blocks: seek.blocks,
    expanded(panel, open) {
      pills.get(panel)?.setAttribute("aria-expanded", String(open));
    },
    keep: () => void keepNow(),
    camera(there, followed) {
      if (camera.hidden === there) camera.hidden = !there;
      if (camera.ariaPressed !== String(followed)) camera.ariaPressed = String(followed);
    },
    health(health) {
      dot.dataset.state = health;
      dot.setAttribute("aria-label", say(HEALTH[health]));
    },
  };
}
