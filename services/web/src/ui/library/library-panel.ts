/**
 * Library panel: drop zone, progress of uploads and downloads, errors, list of motions, avatar section, and the guide
 * for live performers.
 */
import type { MotionQuery, UploadProgress } from "../../client/api";
import { formatPercent } from "../../i18n/number-format";
import { joinList, translate, translateToParts } from "../../i18n/translator";
import { element, setAttribute, setText } from "../dom";
import { formatDuration, formatIngestStage, formatUploadProgress } from "../format";
import { type IconName, icon, motionGlyph } from "../icon";
import { createPanel, type Panel } from "../panel";
import { type AvatarActions, type AvatarChooser, createAvatarChooser } from "./avatar-chooser";
import { createDownloadMenu, type DownloadMenu, type RequestDownload } from "./download-menu";
import type { LibraryFilter, LibraryTools, MotionRow } from "./library-tools";
import type { EditActions } from "./motion-editor";
import type { MotionItem } from "./motion-item";
import type { CaptureTarget } from "./performer-guide";

export interface UploadRow {
  /** Show the bytes sent, of `total`, after `seconds` seconds. */
  showSent(loaded: number, total: number, seconds: number): void;
  /** Show the stage of the server's work, and its fraction done. */
  showIngest(stage: UploadProgress["stage"], fraction: number): void;
  remove(): void;
}

export interface DownloadRow {
  /** Show the current step, and the fraction of the whole. */
  showProgress(text: string, fraction: number): void;
  remove(): void;
}

export interface LibraryPanel {
  readonly panel: Panel;
  readonly danceAs: AvatarChooser;
  /** Load search, pictures, editors and the guide, unless they were loaded before. Call this when the panel opens. */
  load(): void;
  renderMotions(motions: readonly MotionItem[], current: string | null, filter: LibraryFilter): void;
  addUpload(name: string, cancel: () => void): UploadRow;
  addDownload(name: string, cancel: () => void): DownloadRow;
  /** Open the download menu of a motion. */
  showDownloads(id: string): void;
  /** Show an error about the file or motion `name`, in place of the last one. */
  problem(name: string, title: string, detail: string, hint: string | null): void;
}

export interface LibraryActions extends AvatarActions {
  files(files: readonly File[]): void;
  choose(id: string): void;
  remove(motion: MotionItem): void;
  /** Add the motion's performers to those on the stage. Omitted if this page may not. */
  add?(motion: MotionItem): void;
  download(motion: MotionItem, ...request: Parameters<RequestDownload>): void;
  /** Show the motions of a query. */
  search(query: MotionQuery): void;
  /** Change motions. Omitted if this page may not. */
  edits?: EditActions;
  /** Return where a capture tool performs. Omitted if this page may not perform. */
  captureTarget?(): CaptureTarget;
  close(): void;
}

export const ACCEPTED_FILE_TYPES = ".bvh,.fbx,.glb,.gltf,.vrma,.zip,.vrm";

export function createLibraryPanel(root: HTMLElement, actions: LibraryActions): LibraryPanel {
  const panel = createPanel(root, "library", translate("Library"), actions.close);
  const picker = element("input", { type: "file", accept: ACCEPTED_FILE_TYPES, multiple: true, hidden: true });
  picker.addEventListener("change", () => {
    actions.files([...(picker.files ?? [])]);
    picker.value = ""; // so that choosing the same file again is a change
  });
  const drop = element(
    "button",
    { class: "drop", type: "button", onClick: () => picker.click() },
    icon("upload"),
    element("b", {}, translate("Drop a dance here")),
  );
  drop.append(
    element("span", {}, translate("motion .bvh, .fbx, .glb, .vrma or .zip, up to 64 MB, or press to choose")),
  );
  const transfers = element("div", { role: "group", "aria-label": translate("Uploads and downloads") });
  const alert = element("div", { role: "alert" });
  const list = element("ul", { class: "motions" });
  const empty = element(
    "p",
    { class: "empty", hidden: true },
    translate("No dances yet. Drop a motion capture file anywhere on this page and the puppet dances it."),
  );
  /** Motion whose download menu is open. */
  let openMenu: string | null = null;
  const menus = new Map<string, DownloadMenu>();
  const danceAs = createAvatarChooser(actions);
  panel.body.append(drop, picker, transfers, alert, list, empty, danceAs.element);
  const { captureTarget } = actions;
  let isGuideRequested = captureTarget === undefined;
  let areToolsRequested = false;
  let tools: LibraryTools | null = null;
  let shown: Parameters<LibraryPanel["renderMotions"]> = [[], null, { tags: [], isFiltered: false }];

  const renderMotions: LibraryPanel["renderMotions"] = (motions, current, filter) => {
    shown = [motions, current, filter];
    empty.hidden = motions.length > 0 || filter.isFiltered;
    menus.clear();
    const focused = document.activeElement;
    list.replaceChildren(
      ...motions.map((motion) => {
        const menu = createDownloadMenu(
          motion,
          motion.id === openMenu,
          (open) => (openMenu = open ? motion.id : null),
          (...request) => actions.download(motion, ...request),
        );
        menus.set(motion.id, menu);
        const row = createMotionRow(motion, current, menu, actions);
        tools?.extend(row, motion);
        return row.item;
      }),
    );
    tools?.render(motions.length, filter);
    // An open editor keeps the focus.
    if (focused instanceof HTMLElement && list.contains(focused)) focused.focus({ preventScroll: true });
  };
  const loadTools = () => {
    if (areToolsRequested) return;
    areToolsRequested = true;
    import("./library-tools").then(
      ({ createLibraryTools }) => {
        tools = createLibraryTools(actions);
        list.before(tools.search);
        renderMotions(...shown);
      },
      // the next opening tries again
      () => (areToolsRequested = false),
    );
  };
  return {
    panel,
    danceAs,
    load() {
      loadTools();
      if (isGuideRequested) return;
      isGuideRequested = true;
      import("./performer-guide").then(
        ({ createPerformerGuide }) => panel.body.append(createPerformerGuide(captureTarget!)),
        // the next opening tries again
        () => (isGuideRequested = false),
      );
    },
    renderMotions,
    addUpload(name, cancel) {
      const { show, remove } = createProgressRow(transfers, "upload", name, cancel);
      return {
        showSent: (loaded, total, seconds) =>
          show(total > 0 ? loaded / total : 0, formatUploadProgress(loaded, total, seconds)),
        showIngest: (stage, fraction) => show(fraction, formatIngestStage(stage)),
        remove,
      };
    },
    addDownload(name, cancel) {
      const { show, remove } = createProgressRow(transfers, "download", name, cancel);
      return { showProgress: (text, fraction) => show(fraction, text), remove };
    },
    showDownloads: (id) => menus.get(id)?.open(),
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
      alert.replaceChildren(box);
    },
  };
}

/** Create the list entry of a motion; `current` is the motion on the stage. */
function createMotionRow(
  motion: MotionItem,
  current: string | null,
  menu: DownloadMenu,
  actions: LibraryActions,
): MotionRow {
  const choose = element("button", { class: "motion", type: "button", onClick: () => actions.choose(motion.id) });
  setAttribute(choose, "aria-current", motion.id === current ? "true" : null);
  const glyph = element("span", { class: "motion-glyph" });
  glyph.append(motionGlyph(motion.id));
  const text = element(
    "span",
    { class: "motion-text" },
    element("b", { dir: "auto" }, motion.name),
    element("small", {}, motion.detail),
  );
  if (motion.tags.length > 0)
    text.append(element("small", { class: "motion-tags", dir: "auto" }, motion.tags.join(" \u00b7 ")));
  choose.append(glyph, text, element("span", { class: "motion-length" }, formatDuration(motion.seconds)));
  const { name } = motion;
  const remove = createToolButton("bin", "motion-remove", translate("Remove {name}", { name }), () =>
    actions.remove(motion),
  );
  const tools = element("div", { class: "motion-tools" }, menu.button, remove);
  if (actions.add && current !== null)
    tools.prepend(
      createToolButton("add", "motion-add", translate("Add {name} to the stage", { name }), () =>
        actions.add?.(motion),
      ),
    );
  return { item: element("li", {}, choose, tools, menu.choices), glyph, tools };
}

function createToolButton(iconName: IconName, kind: string, name: string, onClick: () => void): HTMLElement {
  return element(
    "button",
    { class: `round-button ${kind}`, type: "button", "aria-label": name, title: name, onClick },
    icon(iconName),
  );
}

/** Append a progress row to `list`, with a button that calls `cancel`. */
function createProgressRow(
  list: HTMLElement,
  kind: "upload" | "download",
  name: string,
  cancel: () => void,
): { show(fraction: number, text: string): void; remove(): void } {
  const percentage = element("span", {}, formatPercent(0));
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
  const stop = element(
    "button",
    { class: "text-button", type: "button", "aria-label": cancelLabel, onClick: cancel },
    translate("Cancel"),
  );
  const row = element(
    "div",
    { class: "upload" },
    element("div", { class: "upload-row" }, element("span", { class: "upload-name", dir: "auto" }, name), percentage),
    bar,
  );
  row.append(element("div", { class: "upload-row" }, state, stop));
  list.append(row);
  return {
    show(fraction, text) {
      const percent = Math.floor(fraction * 100);
      setText(percentage, formatPercent(percent / 100));
      setText(state, text);
      fill.style.width = `${percent}%`;
      bar.setAttribute("aria-valuenow", String(percent));
      bar.setAttribute("aria-valuetext", joinList([text, formatPercent(percent / 100)]));
    },
    remove: () => row.remove(),
  };
}

/** Accept files dropped anywhere on the page. A gold frame is shown while files are dragged over it. */
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
