/** Row of an upload or a download: name, progress, state and a button to cancel it. */
import { formatPercent } from "../../i18n/number-format";
import { joinList, translate } from "../../i18n/translator";
import { element, setText } from "../dom";

export interface ProgressRow {
  /** Show the state, and the fraction done. */
  show(fraction: number, text: string): void;
  /** Remove the row. Focus within it goes to the row's neighbour if its button was pressed, else to `next`. */
  remove(next: HTMLElement): void;
}

/** Append a progress row to `list`, with a button that calls `cancel`. */
export function createProgressRow(
  list: HTMLElement,
  kind: "upload" | "download",
  name: string,
  cancel: () => void,
): ProgressRow {
  const percentage = element("span", { class: "upload-share" }, formatPercent(0));
  const fill = element("i", { style: "width: 0" });
  const [label, cancelLabel] =
    kind === "upload"
      ? [translate("Upload of {name}", { name }), translate("Cancel the upload of {name}", { name })]
      : [translate("Download of {name}", { name }), translate("Cancel the download of {name}", { name })];
  const bar = element(
    "div",
    { class: "progress", role: "progressbar", "aria-label": label, "aria-valuemin": 0, "aria-valuemax": 100 },
    fill,
  );
  const state = element("span", {}, translate("waiting"));
  let isCancelled = false;
  const onCancel = () => {
    isCancelled = true;
    cancel();
  };
  const stop = element(
    "button",
    { class: "text-button", type: "button", "aria-label": cancelLabel, onClick: onCancel },
    translate("Cancel"),
  );
  const row = element(
    "div",
    { class: "upload upload-waiting" },
    element("div", { class: "upload-row" }, element("span", { class: "upload-name", dir: "auto" }, name), percentage),
    bar,
  );
  row.append(element("div", { class: "upload-row" }, state, stop));
  list.append(row);
  return {
    show(fraction, text) {
      row.classList.remove("upload-waiting");
      const percent = Math.floor(fraction * 100);
      setText(percentage, formatPercent(percent / 100));
      setText(state, text);
      fill.style.width = `${percent}%`;
      bar.setAttribute("aria-valuenow", String(percent));
      bar.setAttribute("aria-valuetext", joinList([text, formatPercent(percent / 100)]));
    },
    remove: (next) => removeFocused(row, isCancelled ? findNeighbour(row) : null, next),
  };
}

/** Remove an item of a list. If it had the focus, its neighbour gets it, or else `next`. */
export function removeItem(item: HTMLElement, next: HTMLElement): void {
  removeFocused(item, findNeighbour(item), next);
}

function findNeighbour(item: HTMLElement): HTMLElement | null {
  return (item.nextElementSibling ?? item.previousElementSibling)?.querySelector("button") ?? null;
}

function removeFocused(item: HTMLElement, neighbour: HTMLElement | null, next: HTMLElement): void {
  const hadFocus = item.contains(document.activeElement);
  item.remove();
  if (hadFocus) (neighbour ?? next).focus();
}
