/** Transport bar: play, seek, loop, camera, sound, picture, recording, and the buttons of the three panels. */
import { type PlainMessageKey, translate } from "../../i18n/translator";
import { element, setAttribute, setText } from "../dom";
import { formatDuration } from "../format";
import { type IconName, icon } from "../icon";
import { createSeekBar } from "./seek-bar";
import { createSoundControl, type SoundActions, type SoundControl } from "./sound-control";

export type PanelName = "library" | "strings" | "line";
export type LinkHealth = "good" | "poor" | "lost" | "none";

export interface Transport {
  /** Elements that cover the picture. */
  readonly parts: readonly HTMLElement[];
  readonly sound: SoundControl;
  setTimeline(playing: boolean, loop: boolean, ready: boolean): void;
  setPosition(seconds: number, duration: number): void;
  setBlocks(blocks: ArrayLike<number>, levelCount: number): void;
  setExpanded(panel: PanelName, open: boolean): void;
  setHealth(health: LinkHealth): void;
  /** Record the performance, as the button does. */
  record(): void;
  /** Show whether the motion has a camera, and whether the view follows it. */
  setCamera(available: boolean, followed: boolean): void;
}

const PANELS: readonly { name: PanelName; label: PlainMessageKey; icon: IconName }[] = [
  { name: "library", label: "Library", icon: "library" },
  { name: "strings", label: "Strings", icon: "strings" },
  { name: "line", label: "Connection", icon: "line" },
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
  /** Follow the motion's camera, or stop following it. */
  camera(): void;
  /** Save a picture of the stage. */
  picture(): void;
  /**
   * Record the performance as a new motion; resolves on success and on a reported failure. Omitted if this page may
   * not.
   */
  keep?(): Promise<void>;
}

export function createTransport(root: HTMLElement, actions: TransportActions): Transport {
  const play = element(
    "button",
    { class: "play", type: "button", disabled: true, onClick: actions.play },
    icon("play"),
  );
  const [positionText, durationText] = [element("span"), element("span")];
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
  const recordLabel = element("span", {}, translate(RECORD_LABEL));
  const recordButton = element(
    "button",
    {
      class: "pill keep",
      type: "button",
      "aria-label": translate(RECORD_LABEL),
      disabled: true,
      hidden: !actions.keep,
      onClick: () => void record(),
    },
    icon("keep"),
    recordLabel,
  );
  let ready = false;
  let recording = false;
  const renderRecordButton = () => {
    recordButton.disabled = !ready;
    setAttribute(recordButton, "aria-busy", recording);
    setText(recordLabel, translate(recording ? RECORDING_LABEL : RECORD_LABEL));
    recordButton.setAttribute("aria-label", translate(recording ? RECORDING_LABEL : RECORD_LABEL));
  };
  const record = async () => {
    if (!ready || recording || !actions.keep) return;
    recording = true;
    renderRecordButton();
    try {
      await actions.keep();
    } finally {
      recording = false;
      renderRecordButton();
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
    element("div", { class: "stage-tools" }, loop, camera, sound.element, picture),
    recordButton,
    element("span", { class: "tools-rule" }),
    ...pills.values(),
  );
  const area = element(
    "div",
    { class: "seek-area" },
    element("div", { class: "times" }, positionText, durationText),
    seek.element,
  );
  const bar = element("section", { class: "transport", "aria-label": translate("Transport") }, play, area, tools);
  root.append(bar);
  let shown = "";
  return {
    parts: [bar],
    sound,
    setTimeline(playing, looping, isReady) {
      ready = isReady;
      play.disabled = !ready;
      renderRecordButton();
      const state = translate(playing ? "Pause" : "Play");
      setAttribute(loop, "aria-pressed", String(looping));
      if (shown === state) return;
      shown = state;
      play.setAttribute("aria-label", state);
      play.replaceChildren(icon(playing ? "pause" : "play"));
    },
    setPosition(seconds, duration) {
      setText(positionText, formatDuration(seconds));
      setText(durationText, formatDuration(duration));
      seek.setPosition(seconds, duration);
    },
    setBlocks: seek.setBlocks,
    setExpanded(panel, open) {
      pills.get(panel)?.setAttribute("aria-expanded", String(open));
    },
    record: () => void record(),
    setCamera(available, followed) {
      if (camera.hidden === available) camera.hidden = !available;
      if (camera.ariaPressed !== String(followed)) camera.ariaPressed = String(followed);
    },
    setHealth(health) {
      setAttribute(dot, "data-state", health);
      setAttribute(dot, "aria-label", translate(HEALTH_LABELS[health]));
    },
  };
}
