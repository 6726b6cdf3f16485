/** Reason for the shown bitrate level or the missing picture, as a text for the user (`proto/messages.md`, 3.8). */

import { formatDecimal } from "../i18n/number-format";
import { type PlainMessageKey, pageTranslator } from "../i18n/translator";
import type { Choice } from "../wire/messages";
import type { PlaybackState } from "./performer-view-set";

const CHOICE_REASONS: Readonly<Record<string, PlainMessageKey>> = {
  best: "the best available",
  line: "as much as the connection allows",
  hands: "so that controlled limbs arrive in time",
  machine: "since drawing is slow on this device",
  buffer: "until more is buffered",
  start: "raised once this level is stable",
  hidden: "since this tab is in the background",
  pinned: "pinned by the address",
};

/** State of a viewer that determines the text. */
export interface ViewerStatus {
  /** Reason for the closed connection, null while it is open. */
  closeReason: string | null;
  /** Number of messages and blocks that could not be decoded. */
  damagedCount: number;
  playback: PlaybackState;
  /** Last choice of the server. */
  choice: Choice | null;
  /** True if the URL sets the level. */
  isPinned: boolean;
}

/** Return the text: a problem if there is one, else the reason for the level. */
export function describeStatus(status: ViewerStatus, { translate } = pageTranslator): string {
  const { closeReason, damagedCount, playback, choice, isPinned } = status;
  if (closeReason !== null) return closeReason;
  if (damagedCount > 0)
    return damagedCount === 1
      ? translate("1 message could not be read")
      : translate("{count} messages could not be read", { count: formatDecimal(damagedCount, 0) });
  if (playback === "starting") return translate("waiting for the first block");
  if (playback === "stalled") return translate("waiting for a block");
  if (!choice) return translate(isPinned ? CHOICE_REASONS.pinned : "chosen by the server");
  const reason = translate(CHOICE_REASONS[choice.reason] ?? "chosen by the server");
  return choice.line === null
    ? reason
    : translate("{reason} ({rate} kbit/s)", { reason, rate: formatDecimal(choice.line / 1000, 1) });
}
