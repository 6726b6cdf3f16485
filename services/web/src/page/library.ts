/** The library drawer: drop zone, uploads with true progress, problems in plain words, and the list of dances. */
import type { UploadProgress } from "../client/library";
import { createDanceAs, type DanceAs, type DanceAsActions } from "./dance-as";
import { element, setAttribute, setText } from "./dom";
import { type ChooseFile, createDownloads, type Downloads } from "./downloads";
import { clockTime, makingProgress, uploadProgress } from "./format";
import { icon, motionGlyph, type IconName } from "./icons";
import { createPanel, type Panel } from "./panels";
import { percent } from "../words/numbers";
import { say, sayAround, series } from "../words/say";

export interface Piece {
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
  sending(loaded: number, total: number, seconds: number): void;
  /** What the server does with it, and the share done. */
  making(stage: UploadProgress["stage"], share: number): void;
  remove(): void;
}

export interface DownloadRow {
  /** What is done, and the share of the whole. */
  doing(words: string, share: number): void;
  remove(): void;
}

export interface Library {
  readonly panel: Panel;
  readonly danceAs: DanceAs;
  pieces(pieces: readonly Piece[], current: string | null): void;
  upload(name: string, cancel: () => void): UploadRow;
  download(name: string, cancel: () => void): DownloadRow;
  /** Shows what a dance of the list may be downloaded as. */
  disclose(id: string): void;
  problem(name: string, title: string, detail: string, hint: string | null): void;
}

export interface LibraryActions extends DanceAsActions {
  files(files: readonly File[]): void;
  choose(id: string): void;
  remove(piece: Piece): void;
  /** Adds who dances in it to those on the stage; left out, that cannot be done here. */
  add?(piece: Piece): void;
  download(piece: Piece, ...file: Parameters<ChooseFile>): void;
  close(): void;
}

export const ACCEPTED = ".bvh,.vrm,.glb";

export function createLibrary(root: HTMLElement, on: LibraryActions): Library {
  const panel = createPanel(root, "library", say("Library"), on.close);
  const picker = element("input", { type: "file", accept: ACCEPTED, multiple: true, hidden: true });
  picker.addEventListener("change", () => {
    on.files([...(picker.files ?? [])]);
    picker.value = ""; // The same file may be chosen again.
  });
  const drop = element("button", { class: "drop", type: "button", onClick: () => picker.click() }, icon("upload"), element("b", {}, say("Drop a dance here")));
  drop.append(element("span", {}, say("motion .bvh, up to 64 MB, or press to choose")));
  const doing = element("div", { role: "group", "aria-label": say("Uploads and downloads") });
  const said = element("div", { role: "alert" });
  const list = element("ul", { class: "motions" });
  const empty = element("p", { class: "empty", hidden: true }, say("No dances yet. Drop a motion capture file anywhere on this page and the puppet dances it."));
  /** The dance whose downloads are disclosed. */
  let disclosed: string | null = null;
  const downloads = new Map<string, Downloads>();
  const danceAs = createDanceAs(on);
  panel.body.append(drop, picker, doing, said, list, empty, danceAs.element);
  return {
    panel,
    danceAs,
    pieces(pieces, current) {
      empty.hidden = pieces.length > 0;
      downloads.clear();
      list.replaceChildren(
        ...pieces.map((piece) => {
          const choose = element("button", { class: "motion", type: "button", onClick: () => on.choose(piece.id) });
          setAttribute(choose, "aria-current", piece.id === current ? "true" : null);
          const glyph = element("span", { class: "motion-glyph" });
          glyph.append(motionGlyph(piece.id));
          const text = element("span", { class: "motion-text" }, element("b", {}, piece.name), element("small", {}, piece.detail));
          choose.append(glyph, text, element("span", { class: "motion-length" }, clockTime(piece.seconds)));
          const told = (open: boolean) => (disclosed = open ? piece.id : null);
          const one = createDownloads(piece, piece.id === disclosed, told, (...file) => on.download(piece, ...file));
          downloads.set(piece.id, one);
          const remove = tool("bin", "motion-remove", say("Remove {name}", { name: piece.name }), () => on.remove(piece));
          const tools = element("div", { class: "motion-tools" }, one.button, remove);
          // beside whom it is to dance
          if (on.add && current !== null) tools.prepend(tool("add", "motion-add", say("Add {name} to the stage", { name: piece.name }), () => on.add?.(piece)));
          return element("li", {}, choose, tools, one.choices);
        }),
      );
    },
    upload(name, cancel) {
      const { show, remove } = underWay(doing, "upload", name, cancel);
      return {
        sending: (loaded, total, seconds) => show(total > 0 ? loaded / total : 0, uploadProgress(loaded, total, seconds)),
        making: (stage, done) => show(done, makingProgress(stage)),
        remove,
      };
    },
    download(name, cancel) {
      const { show, remove } = underWay(doing, "download", name, cancel);
      return { doing: (words, done) => show(done, words), remove };
    },
    disclose: (id) => downloads.get(id)?.disclose(),
    problem(name, title, detail, hint) {
      const box = element("div", { class: "problem" }, element("b", {}, ...sayAround("{name}: {title}", { name: element("bdi", {}, name), title })), element("p", {}, detail));
      if (hint) box.append(element("p", { class: "muted" }, hint));
      box.append(element("button", { class: "text-button", type: "button", onClick: () => box.remove() }, say("Dismiss")));
      said.replaceChildren(box);
    },
  };
}

function tool(drawn: IconName, kind: string, name: string, act: () => void): HTMLElement {
  return element("button", { class: `round-button ${kind}`, type: "button", "aria-label": name, title: name, onClick: act }, icon(drawn));
}

/** A row of `list` for what is under way, with the share done and what will be cancelled. */
function underWay(list: HTMLElement, kind: "upload" | "download", name: string, cancel: () => void): { show(done: number, words: string): void; remove(): void } {
  const share = element("span", {}, percent(0));
  const fill = element("i", { style: "width: 0" });
  const [label, stopping] =
    kind === "upload"
      ? [say("Upload of {name}", { name }), say("Cancel the upload of {name}", { name })]
      : [say("Download of {name}", { name }), say("Cancel the download of {name}", { name })];
  const bar = element("div", { class: "progress", role: "progressbar", "aria-label": label, "aria-valuemin": 0, "aria-valuemax": 100 }, fill);
  const state = element("span", {}, say("waiting"));
  const stop = element("button", { class: "text-button", type: "button", "aria-label": stopping, onClick: cancel }, say("Cancel"));
  const row = element("div", { class: "upload" }, element("div", { class: "upload-row" }, element("span", { class: "upload-name" }, name), share), bar);
  row.append(element("div", { class: "upload-row" }, state, stop));
  list.append(row);
  return {
    show(done, words) {
      const hundredths = Math.floor(done * 100);
      setText(share, percent(hundredths / 100));
      setText(state, words);
      fill.style.width = `${hundredths}%`;
      bar.setAttribute("aria-valuenow", String(hundredths));
      bar.setAttribute("aria-valuetext", series([words, percent(hundredths / 100)]));
    },
    remove: () => row.remove(),
  };
}

/** Files dropped anywhere on the page; a gold frame shows that they may be. */
export function acceptDrops(root: HTMLElement, on: (files: readonly File[]) => void): void {
  const frame = element("div", { class: "drop-frame", hidden: true }, element("span", {}, say("Drop a dance, or an avatar to dance as")));
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
    on([...(event.dataTransfer?.files ?? [])]);
  });
}
