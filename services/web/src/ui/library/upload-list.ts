/** Uploads in the library panel: a row for each file, and above several rows a summary that cancels all. */
import type { UploadProgress } from "../../client/api";
import { formatPercent } from "../../i18n/number-format";
import { joinList, translate } from "../../i18n/translator";
import { element, setText } from "../dom";
import { formatIngestStage, formatUploadProgress } from "../format";
import { createProgressRow, removeItem } from "./progress-row";

export interface UploadRow {
  /** Show the progress of a file of `size` bytes, `seconds` after its start. */
  show(progress: UploadProgress, size: number, seconds: number): void;
  remove(): void;
}

export interface UploadSummary {
  /** Number of the current file, from 1, and of all. */
  number: number;
  count: number;
  /** Completed fraction of all files. */
  fraction: number;
}

export interface UploadList {
  addFile(name: string, cancel: () => void): UploadRow;
  /** Show the summary, or hide it if it is null. */
  showSummary(summary: UploadSummary | null): void;
}

/** Create the list in `root`. `next` gets the focus of a row that was removed. */
export function createUploadList(root: HTMLElement, next: HTMLElement, cancelAll: () => void): UploadList {
  const text = element("span", { class: "upload-name" });
  const fill = element("i", { style: "width: 0" });
  const bar = element(
    "div",
    { class: "progress", role: "progressbar", "aria-valuemin": 0, "aria-valuemax": 100 },
    fill,
  );
  bar.setAttribute("aria-label", translate("All uploads"));
  const stop = element(
    "button",
    { class: "text-button", type: "button", "aria-label": translate("Cancel all uploads"), onClick: cancelAll },
    translate("Cancel all"),
  );
  const summary = element("div", { class: "upload" }, element("div", { class: "upload-row" }, text, stop));
  summary.append(bar);
  const rows = element("div", { class: "upload-list" });
  root.replaceChildren(rows);
  return {
    addFile(name, cancel) {
      const row = createProgressRow(rows, "upload", name, cancel);
      return {
        show: (progress, size, seconds) => row.show(shareOfStage(progress), describeProgress(progress, size, seconds)),
        remove: () => row.remove(next),
      };
    },
    showSummary(shown) {
      if (shown === null) {
        removeItem(summary, next);
        return;
      }
      if (!summary.isConnected) root.prepend(summary);
      const { number, count, fraction } = shown;
      const percent = Math.floor(fraction * 100);
      setText(text, joinList([translate("File {number} of {count}", { number, count }), formatPercent(percent / 100)]));
      fill.style.width = `${percent}%`;
      bar.setAttribute("aria-valuenow", String(percent));
      bar.setAttribute("aria-valuetext", text.textContent);
    },
  };
}

/** Return the completed share of a stage; that of all takes, if the file has several. */
export function shareOfStage({ share, take = 1, takes = 1 }: UploadProgress): number {
  return (take - 1 + share) / takes;
}

function describeProgress(progress: UploadProgress, size: number, seconds: number): string {
  const { stage, share, take = 1, takes = 1 } = progress;
  if (stage === "sending") return formatUploadProgress(share * size, size, seconds);
  const text = formatIngestStage(stage);
  return takes > 1 ? joinList([translate("take {number} of {count}", { number: take, count: takes }), text]) : text;
}
