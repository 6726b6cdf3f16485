/** The seek bar: a slider with one cell a block, coloured and raised by quality. */

import { joinList, translate } from "../../i18n/translator";
import { element, setAttribute, setText } from "../dom";
import { formatDuration } from "../format";
import { bufferedTo, type SeekCell, seekCells } from "./seek-cell";

const QUALITY_NAMES = ["lowest detail", "low detail", "good detail", "full detail"] as const;
const MAX_CELLS = { desktop: 68, phone: 44 };

export interface SeekBar {
  readonly element: HTMLElement;
  setBlocks(blocks: ArrayLike<number>, levelCount: number): void;
  setPosition(seconds: number, duration: number): void;
}

/** `onSeek` gets seconds, also while dragging; arrow keys go by one block. */
export function createSeekBar(onSeek: (seconds: number) => void): SeekBar {
  const head = element("span", { class: "seek-head", hidden: true });
  const hint = element("span", { class: "seek-hint", hidden: true });
  const bar = element("div", {
    class: "seek",
    role: "slider",
    tabindex: 0,
    "aria-label": translate("Seek"),
    "aria-valuemin": 0,
  });
  let cells: SeekCell[] = [];
  let marks: HTMLElement[] = [];
  let held: ArrayLike<number> = [];
  let [at, length] = [0, 0];
  let shownAs = "";

  const secondsAt = (event: PointerEvent) => {
    const box = bar.getBoundingClientRect();
    return Math.min(1, Math.max(0, (event.clientX - box.left) / box.width)) * length;
  };
  const point = (event: PointerEvent) => {
    if (length <= 0) return;
    const seconds = secondsAt(event);
    const cell = cells.find(({ start, end }) => seconds / length >= start && seconds / length < end);
    setText(
      hint,
      joinList([
        formatDuration(seconds),
        translate(cell && cell.quality >= 0 ? QUALITY_NAMES[cell.quality] : "not here yet"),
      ]),
    );
    hint.style.left = `${(seconds / length) * 100}%`;
    hint.hidden = false;
  };
  bar.addEventListener("pointerdown", (event) => {
    if (length <= 0 || event.button !== 0) return;
    bar.setPointerCapture(event.pointerId);
    onSeek(secondsAt(event));
  });
  bar.addEventListener("pointermove", (event) => {
    point(event);
    if (bar.hasPointerCapture(event.pointerId)) onSeek(secondsAt(event));
  });
  bar.addEventListener("pointerleave", () => (hint.hidden = true));
  bar.addEventListener("keydown", (event) => {
    const block = held.length > 0 ? length / held.length : 1;
    const to: Record<string, number> = {
      ArrowLeft: at - block,
      ArrowDown: at - block,
      ArrowRight: at + block,
      ArrowUp: at + block,
      PageDown: at - 10 * block,
      PageUp: at + 10 * block,
      Home: 0,
      End: length,
    };
    if (!(event.key in to) || length <= 0) return;
    event.preventDefault();
    event.stopPropagation();
    onSeek(Math.min(length, Math.max(0, to[event.key])));
  });

  const markPlayed = () => {
    const place = length > 0 ? at / length : 0;
    cells.forEach((cell, i) => marks[i].classList.toggle("played", cell.quality >= 0 && cell.start < place));
  };
  return {
    element: bar,
    setBlocks(blocks, rates) {
      held = blocks;
      cells = seekCells(blocks, rates, innerWidth <= 720 ? MAX_CELLS.phone : MAX_CELLS.desktop);
      const now = cells.map((cell) => cell.quality).join();
      if (now === shownAs) return;
      shownAs = now;
      marks = cells.map(({ quality }) =>
        quality < 0
          ? element("i", { class: "missing" })
          : element("i", { style: `--quality:${quality};--cell:var(--quality-${quality})` }),
      );
      bar.replaceChildren(...marks, head, hint);
      markPlayed();
    },
    setPosition(seconds, duration) {
      const moved = Math.floor(seconds * 4) !== Math.floor(at * 4) || duration !== length;
      [at, length] = [seconds, duration];
      head.hidden = duration <= 0;
      head.style.left = `${duration > 0 ? (seconds / duration) * 100 : 0}%`;
      if (!moved) return;
      markPlayed();
      setAttribute(bar, "aria-valuemax", Math.round(duration));
      setAttribute(bar, "aria-valuenow", Math.round(seconds));
      const buffered = formatDuration(bufferedTo(held, seconds, duration));
      setAttribute(
        bar,
        "aria-valuetext",
        translate("{time} of {whole}, buffered to {buffered}", {
          time: formatDuration(seconds),
          whole: formatDuration(duration),
          buffered,
        }),
      );
      setAttribute(bar, "aria-disabled", duration > 0 ? null : "true");
    },
  };
}
