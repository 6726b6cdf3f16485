/** The library drawer: drop zone, uploads with true progress, problems in plain words, and the list of dances. */
import type { UploadProgress } from "../../client/api";
import { formatPercent } from "../../i18n/number-format";
import { joinList, translate, translateToParts } from "../../i18n/translator";
import { element, setAttribute, setText } from "../dom";
import { formatDuration, formatIngestStage, formatUploadProgress } from "../format";
import { type IconName, icon, motionGlyph } from "../icon";
import { createPanel, type Panel } from "../panel";
import { type AvatarActions, type AvatarChooser, createAvatarChooser } from "./avatar-chooser";
import { createDownloadMenu, type DownloadMenu, type RequestDownload } from "./download-menu";

export interface MotionItem {
  id: string;
  name: string;
  /** What kind of recording: "40 Hz, 1.2 mm". */
  detail: string;
  seconds: number;
  /** How many dance in it. */
  performers: number;
}

export interface UploadRow {
  /** Bytes sent and in all, after so many seconds. */
  showSent(loaded: number, total: number, seconds: number): void;
  /** What the server does with it, and the share done. */
  showIngest(stage: UploadProgress["stage"], fraction: number): void;
  remove(): void;
}

export interface DownloadRow {
  /** What is done, and the share of the whole. */
  showProgress(text: string, fraction: number): void;
  remove(): void;
}

export interface LibraryPanel {
  readonly panel: Panel;
  readonly danceAs: AvatarChooser;
  renderMotions(pieces: readonly MotionItem[], current: string | null): void;
  addUpload(name: string, cancel: () => void): UploadRow;
  addDownload(name: string, cancel: () => void): DownloadRow;
  /** Shows what a dance of the list may be downloaded as. */
  showDownloads(id: string): void;
  problem(name: string, title: string, detail: string, hint: string | null): void;
}

export interface LibraryActions extends AvatarActions {
  files(files: readonly File[]): void;
  choose(id: string): void;
  remove(piece: MotionItem): void;
  /** Adds who dances in it to those on the stage; left out, that cannot be done here. */
  add?(piece: MotionItem): void;
  download(piece: MotionItem, ...file: Parameters<RequestDownload>): void;
  close(): void;
}

export const ACCEPTED_FILE_TYPES = ".bvh,.vrm,.glb";

export function createLibraryPanel(root: HTMLElement, actions: LibraryActions): LibraryPanel {
  const panel = createPanel(root, "library", translate("Library"), actions.close);
  const picker = element("input", { type: "file", accept: ACCEPTED_FILE_TYPES, multiple: true, hidden: true });
  picker.addEventListener("change", () => {
    actions.files([...(picker.files ?? [])]);
    picker.value = ""; // The same file may be chosen again.
  });
  const drop = element(
    "button",
    { class: "drop", type: "button", onClick: () => picker.click() },
    icon("upload"),
    element("b", {}, translate("Drop a dance here")),
  );
  drop.append(element("span", {}, translate("motion .bvh, up to 64 MB, or press to choose")));
  const doing = element("div", { role: "group", "aria-label": translate("Uploads and downloads") });
  const said = element("div", { role: "alert" });
  const list = element("ul", { class: "motions" });
  const empty = element(
    "p",
    { class: "empty", hidden: true },
    translate("No dances yet. Drop a motion capture file anywhere on this page and the puppet dances it."),
  );
  /** The dance whose downloads are disclosed. */
  let disclosed: string | null = null;
  const downloads = new Map<string, DownloadMenu>();
  const danceAs = createAvatarChooser(actions);
  panel.body.append(drop, picker, doing, said, list, empty, danceAs.element);
  return {
    panel,
    danceAs,
    renderMotions(pieces, current) {
      empty.hidden = pieces.length > 0;
      downloads.clear();
      list.replaceChildren(
        ...pieces.map((piece) => {
          const choose = element("button", {
            class: "motion",
            type: "button",
            onClick: () => actions.choose(piece.id),
          });
          setAttribute(choose, "aria-current", piece.id === current ? "true" : null);
          const glyph = element("span", { class: "motion-glyph" });
          glyph.append(motionGlyph(piece.id));
          const text = element(
            "span",
            { class: "motion-text" },
            element("b", {}, piece.name),
            element("small", {}, piece.detail),
          );
          choose.append(glyph, text, element("span", { class: "motion-length" }, formatDuration(piece.seconds)));
          const told = (open: boolean) => (disclosed = open ? piece.id : null);
          const one = createDownloadMenu(piece, piece.id === disclosed, told, (...file) =>
            actions.download(piece, ...file),
          );
          downloads.set(piece.id, one);
          const remove = createToolButton(
            "bin",
            "motion-remove",
            translate("Remove {name}", { name: piece.name }),
            () => actions.remove(piece),
          );
          const tools = element("div", { class: "motion-tools" }, one.button, remove);
          // beside whom it is to dance
          if (actions.add && current !== null)
            tools.prepend(
              createToolButton("add", "motion-add", translate("Add {name} to the stage", { name: piece.name }), () =>
                actions.add?.(piece),
              ),
            );
          return element("li", {}, choose, tools, one.choices);
        }),
      );
    },
    addUpload(name, cancel) {
      const { show, remove } = createProgressRow(doing, "upload", name, cancel);
      return {
        showSent: (loaded, total, seconds) =>
          show(total > 0 ? loaded / total : 0, formatUploadProgress(loaded, total, seconds)),
        showIngest: (stage, done) => show(done, formatIngestStage(stage)),
        remove,
      };
    },
    addDownload(name, cancel) {
      const { show, remove } = createProgressRow(doing, "download", name, cancel);
      return { showProgress: (words, done) => show(done, words), remove };
    },
    showDownloads: (id) => downloads.get(id)?.open(),
    problem(name, title, detail, hint) {
      const box = element(
        "div",
        { class: "problem" },
        element("b", {}, ...translateToParts("{name}: {title}", { name: element("bdi", {}, name), title })),
        element("p", {}, detail),
      );
      if (hint) box.append(element("p", { class: "muted" }, hint));
      box.append(
        element("button", { class: "text-button", type: "button", onClick: () => box.remove() }, translate("Dismiss")),
      );
      said.replaceChildren(box);
    },
  };
}

function createToolButton(drawn: IconName, kind: string, name: string, act: () => void): HTMLElement {
  return element(
    "button",
    { class: `round-button ${kind}`, type: "button", "aria-label": name, title: name, onClick: act },
    icon(drawn),
  );
}

/** A row of `list` for what is under way, with the share done and what will be cancelled. */
function createProgressRow(
  list: HTMLElement,
  kind: "upload" | "download",
  name: string,
  cancel: () => void,
): { show(done: number, words: string): void; remove(): void } {
  const share = element("span", {}, formatPercent(0));
  const fill = element("i", { style: "width: 0" });
  const [label, stopping] =
    kind === "upload"
      ? [translate("Upload of {name}", { name }), translate("Cancel the upload of {name}", { name })]
      : [translate("Download of {name}", { name }), translate("Cancel the download of {name}", { name })];
  const bar = element(
    "div",
    { class: "progress", role: "progressbar", "aria-label": label, "aria-valuemin": 0, "aria-valuemax": 100 },
    fill,
  );
  const state = element("span", {}, translate("waiting"));
  const stop = element(
    "button",
    { class: "text-button", type: "button", "aria-label": stopping, onClick: cancel },
    translate("Cancel"),
  );
  const row = element(
    "div",
    { class: "upload" },
    element("div", { class: "upload-row" }, element("span", { class: "upload-name" }, name), share),
    bar,
  );
  row.append(element("div", { class: "upload-row" }, state, stop));
  list.append(row);
  return {
    show(done, words) {
      const hundredths = Math.floor(done * 100);
      setText(share, formatPercent(hundredths / 100));
      setText(state, words);
      fill.style.width = `${hundredths}%`;
      bar.setAttribute("aria-valuenow", String(hundredths));
      bar.setAttribute("aria-valuetext", joinList([words, formatPercent(hundredths / 100)]));
    },
    remove: () => row.remove(),
  };
}

/** Files dropped anywhere on the page; a gold frame shows that they may be. */
export function acceptDrops(root: HTMLElement, onFiles: (files: readonly File[]) => void): void {
  const frame = element(
    "div",
    { class: "drop-frame", hidden: true },
    element("span", {}, translate("Drop a dance, or an avatar to dance as")),
  );
  root.append(frame);
  const carriesFiles = (event: DragEvent) => event.dataTransfer?.types.includes("Files") ?? false;
  addEventListener("dragover", (event) => {
    if (!carriesFiles(event)) return;
    event.preventDefault();
    frame.hidden = false;
  });
  addEventListener("dragleave", (event) => {
    if (event.relatedTarget === null) frame.hidden = true;
  });
  addEventListener("drop", (event) => {
    if (!carriesFiles(event)) return;
    event.preventDefault();
    frame.hidden = true;
    onFiles([...(event.dataTransfer?.files ?? [])]);
  });
}
