/** Play, seek, loop, sound, picture, keep, and the three panels' buttons. */

import { type PlainMessageKey, translate } from "../../i18n/translator";
import { element, setAttribute, setText } from "../dom";
import { formatDuration } from "../format";
import { type IconName, icon } from "../icon";
import { createSeekBar } from "./seek-bar";
import { createSoundControl, type SoundActions, type SoundControl } from "./sound-control";

export type PanelName = "library" | "strings" | "line";
export type LinkHealth = "good" | "poor" | "lost" | "none";

export interface Transport {
  /** What of it stands before the picture: on a phone some of its buttons are beside it. */
  readonly parts: readonly HTMLElement[];
  readonly sound: SoundControl;
  setTimeline(playing: boolean, loop: boolean, ready: boolean): void;
  setPosition(seconds: number, duration: number): void;
  setBlocks(blocks: ArrayLike<number>, levelCount: number): void;
  setExpanded(panel: PanelName, open: boolean): void;
  setHealth(health: LinkHealth): void;
  /** Keeps what is on the stage, as its button does. */
  record(): void;
  /** Whether the dance has a camera of its own, the show's, and whether that is followed. */
  setCamera(available: boolean, followed: boolean): void;
}

const PANELS: readonly { name: PanelName; label: PlainMessageKey; icon: IconName }[] = [
  { name: "library", label: "Library", icon: "library" },
  { name: "strings", label: "Strings", icon: "strings" },
  { name: "line", label: "Line", icon: "line" },
];
const RECORD_LABEL = "Keep this";
const RECORDING_LABEL = "Keeping";
const HEALTH_LABELS: Readonly<Record<LinkHealth, PlainMessageKey>> = {
  good: "good",
  poor: "short of data",
  lost: "not connected",
  none: "no dance yet",
};

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

export function createTransport(root: HTMLElement, actions: TransportActions): Transport {
  const play = element(
    "button",
    { class: "play", type: "button", disabled: true, onClick: actions.play },
    icon("play"),
  );
  const [now, end] = [element("span"), element("span")];
  const seek = createSeekBar(actions.seek);
  const loop = element(
    "button",
    { class: "round-button loop", type: "button", "aria-label": translate("Loop"), onClick: actions.loop },
    icon("loop"),
  );
  const camera = element(
    "button",
    {
      class: "round-button camera",
      type: "button",
      "aria-label": translate("Show's camera"),
      hidden: true,
      onClick: actions.camera,
    },
    icon("camera"),
  );
  const picture = element(
    "button",
    {
      class: "round-button picture",
      type: "button",
      "aria-label": translate("Save a picture"),
      onClick: actions.picture,
    },
    icon("picture"),
  );
  const sound = createSoundControl(actions);
  const keepName = element("span", {}, translate(RECORD_LABEL));
  const keep = element(
    "button",
    {
      class: "pill keep",
      type: "button",
      "aria-label": translate(RECORD_LABEL),
      disabled: true,
      hidden: !actions.keep,
      onClick: () => void keepNow(),
    },
    icon("keep"),
    keepName,
  );
  let ready = false;
  let keeping = false;
  const showKeep = () => {
    keep.disabled = !ready;
    setAttribute(keep, "aria-busy", keeping);
    setText(keepName, translate(keeping ? RECORDING_LABEL : RECORD_LABEL));
    keep.setAttribute("aria-label", translate(keeping ? RECORDING_LABEL : RECORD_LABEL));
  };
  const keepNow = async () => {
    if (!ready || keeping || !actions.keep) return;
    keeping = true;
    showKeep();
    try {
      await actions.keep();
    } finally {
      keeping = false;
      showKeep();
    }
  };
  const dot = element("span", { class: "health", role: "img" });
  const pills = new Map(
    PANELS.map(({ name, label: english, icon: glyph }) => {
      const label = translate(english);
      const pill = element("button", {
        class: "pill",
        type: "button",
        "data-panel": name,
        "aria-label": label,
        "aria-expanded": "false",
        onClick: () => actions.panel(name),
      });
      pill.append(icon(glyph), element("span", {}, label));
      if (name === "line") pill.append(dot);
      return [name, pill] as const;
    }),
  );
  const tools = element(
    "div",
    { class: "tools" },
    loop,
    camera,
    sound.element,
    picture,
    keep,
    element("span", { class: "tools-rule" }),
    ...pills.values(),
  );
  const area = element("div", { class: "seek-area" }, element("div", { class: "times" }, now, end), seek.element);
  const bar = element("section", { class: "transport", "aria-label": translate("Transport") }, play, area, tools);
  root.append(bar);
  let shown = "";
  return {
    parts: [bar, camera, picture, sound.element],
    sound,
    setTimeline(playing, looping, known) {
      ready = known;
      play.disabled = !ready;
      showKeep();
      const state = translate(playing ? "Pause" : "Play");
      setAttribute(loop, "aria-pressed", String(looping));
      if (shown === state) return;
      shown = state;
      play.setAttribute("aria-label", state);
      play.replaceChildren(icon(playing ? "pause" : "play"));
    },
    setPosition(seconds, duration) {
      setText(now, formatDuration(seconds));
      setText(end, formatDuration(duration));
      seek.setPosition(seconds, duration);
    },
    setBlocks: seek.setBlocks,
    setExpanded(panel, open) {
      pills.get(panel)?.setAttribute("aria-expanded", String(open));
    },
    record: () => void keepNow(),
    setCamera(there, followed) {
      if (camera.hidden === there) camera.hidden = !there;
      if (camera.ariaPressed !== String(followed)) camera.ariaPressed = String(followed);
    },
    setHealth(health) {
      dot.dataset.state = health;
      dot.setAttribute("aria-label", translate(HEALTH_LABELS[health]));
    },
  };
}
