/** Seek bar: a slider with one cell per block, whose colour and height show the block's quality. */
import { joinList, translate } from "../../i18n/translator";
import { element, setAttribute, setText } from "../dom";
import { formatDuration } from "../format";
import { bufferedTo, type SeekCell, seekCells } from "./seek-cell";

const QUALITY_NAMES = ["lowest detail", "low detail", "good detail", "full detail"] as const;
/** Positions that the head can take: about one per pixel. */
const HEAD_STEPS = 1000;
const MAX_CELLS = { desktop: 68, phone: 44 };

/** Element of a cell, and what it shows. */
interface Mark {
  readonly element: HTMLElement;
  quality: number;
  isPlayed: boolean;
}

export interface SeekBar {
  readonly element: HTMLElement;
  setBlocks(blocks: ArrayLike<number>, levelCount: number): void;
  setPosition(seconds: number, duration: number): void;
}

/** Create the bar. `onSeek` receives seconds, also while dragging; arrow keys move by one block. */
export function createSeekBar(onSeek: (seconds: number) => void): SeekBar {
  const head = element("span", { class: "seek-head", hidden: true });
  const hint = element("span", { class: "seek-hint", hidden: true });
  const bar = element("div", {
    class: "seek",
    role: "slider",
    tabindex: 0,
    "aria-label": translate("Seek"),
    "aria-valuemin": 0,
    "aria-valuenow": 0,
  });
  bar.append(head, hint);
  let cells: SeekCell[] = [];
  const marks: Mark[] = [];
  let blockLevels: ArrayLike<number> = [];
  let [position, length] = [0, 0];
  let shownHeadPlace = 0;

  const secondsAt = (event: PointerEvent) => {
    const box = bar.getBoundingClientRect();
    return Math.min(1, Math.max(0, (event.clientX - box.left) / box.width)) * length;
  };
  const showHint = (event: PointerEvent) => {
    if (length <= 0) return;
    const seconds = secondsAt(event);
    const cell = cells.find(({ start, end }) => seconds / length >= start && seconds / length < end);
    setText(
      hint,
      joinList([
        formatDuration(seconds),
        translate(cell && cell.quality >= 0 ? QUALITY_NAMES[cell.quality] : "not loaded yet"),
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
    showHint(event);
    if (bar.hasPointerCapture(event.pointerId)) onSeek(secondsAt(event));
  });
  bar.addEventListener("pointerleave", () => (hint.hidden = true));
  bar.addEventListener("keydown", (event) => {
    const block = blockLevels.length > 0 ? length / blockLevels.length : 1;
    const targets: Record<string, number> = {
      ArrowLeft: position - block,
      ArrowDown: position - block,
      ArrowRight: position + block,
      ArrowUp: position + block,
      PageDown: position - 10 * block,
      PageUp: position + 10 * block,
      Home: 0,
      End: length,
    };
    if (!(event.key in targets) || length <= 0) return;
    event.preventDefault();
    event.stopPropagation();
    onSeek(Math.min(length, Math.max(0, targets[event.key])));
  });

  const markPlayed = () => {
    const fraction = length > 0 ? position / length : 0;
    cells.forEach(({ quality, start }, i) => showPlayed(marks[i], quality >= 0 && start < fraction));
  };
  return {
    element: bar,
    setBlocks(blocks, levelCount) {
      blockLevels = blocks;
      cells = seekCells(blocks, levelCount, innerWidth <= 720 ? MAX_CELLS.phone : MAX_CELLS.desktop);
      while (marks.length > cells.length) marks.pop()?.element.remove();
      while (marks.length < cells.length) {
        const mark = { element: element("i"), quality: Number.NaN, isPlayed: false };
        marks.push(mark);
        head.before(mark.element);
      }
      cells.forEach(({ quality }, i) => showQuality(marks[i], quality));
      markPlayed();
    },
    setPosition(seconds, duration) {
      const moved = Math.floor(seconds * 4) !== Math.floor(position * 4) || duration !== length;
      [position, length] = [seconds, duration];
      if (head.hidden !== duration <= 0) head.hidden = duration <= 0;
      const headPlace = duration > 0 ? Math.round((seconds / duration) * HEAD_STEPS) / HEAD_STEPS : 0;
      if (headPlace !== shownHeadPlace) head.style.transform = `translateX(${100 * headPlace}%)`;
      shownHeadPlace = headPlace;
      if (!moved) return;
      markPlayed();
      setAttribute(bar, "aria-valuemax", Math.round(duration));
      setAttribute(bar, "aria-valuenow", Math.round(seconds));
      const buffered = formatDuration(bufferedTo(blockLevels, seconds, duration));
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

/** Show whether a cell was played. Only one cell changes at a time, or none. */
function showPlayed(mark: Mark, isPlayed: boolean): void {
  if (mark.isPlayed === isPlayed) return;
  mark.isPlayed = isPlayed;
  mark.element.classList.toggle("played", isPlayed);
}

/** Show the quality of a cell. An unchanged one is not written again: most blocks change one cell only. */
function showQuality(mark: Mark, quality: number): void {
  if (mark.quality === quality) return;
  mark.quality = quality;
  mark.element.classList.toggle("missing", quality < 0);
  setAttribute(mark.element, "style", quality < 0 ? null : `--quality:${quality};--cell:var(--quality-${quality})`);
}
