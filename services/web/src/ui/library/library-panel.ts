/**
 * Library panel: drop zone, progress of uploads and downloads, errors, list of motions, avatar section, and the guide
 * for live performers.
 */
import type { MotionQuery } from "../../client/api";
import { translate, translateToParts } from "../../i18n/translator";
import { element, setAttribute } from "../dom";
import { formatDuration } from "../format";
import { type IconName, icon, motionGlyph } from "../icon";
import { createPanel, type Panel } from "../panel";
import { type AvatarActions, type AvatarChooser, createAvatarChooser } from "./avatar-chooser";
import { createDownloadMenu, type DownloadMenu, type RequestDownload } from "./download-menu";
import type { LibraryFilter, LibraryTools, MotionRow } from "./library-tools";
import type { EditActions } from "./motion-editor";
import type { MotionItem } from "./motion-item";
import type { CaptureTarget } from "./performer-guide";
import { createProgressRow, removeItem } from "./progress-row";

/** Problems that are shown at the same time. Older ones are removed. */
const MAX_PROBLEMS = 20;

export interface TransferRow {
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
  /** Place of the uploads, and the button before it. */
  readonly uploads: HTMLElement;
  readonly drop: HTMLElement;
  /** Add the progress of a motion that the server makes. */
  addUpload(name: string, cancel: () => void): TransferRow;
  addDownload(name: string, cancel: () => void): TransferRow;
  /** Open the download menu of a motion. */
  showDownloads(id: string): void;
  /** Show an error about the file or motion `name`, in place of an earlier one about it. */
  problem(name: string, title: string, detail: string, hint: string | null): void;
  clearProblems(): void;
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
  const uploads = element("div");
  const transfers = element("div", { role: "group", "aria-label": translate("Uploads and downloads") }, uploads);
  const alert = element("div", { class: "problems", role: "alert" });
  const problems = new Map<string, HTMLElement>();
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
  const addTransfer = (kind: "upload" | "download", name: string, cancel: () => void): TransferRow => {
    const { show, remove } = createProgressRow(transfers, kind, name, cancel);
    return { showProgress: (text, fraction) => show(fraction, text), remove: () => remove(drop) };
  };
  return {
    panel,
    danceAs,
    uploads,
    drop,
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
    addUpload: (name, cancel) => addTransfer("upload", name, cancel),
    addDownload: (name, cancel) => addTransfer("download", name, cancel),
    showDownloads: (id) => menus.get(id)?.open(),
    problem(name, title, detail, hint) {
      const box = element(
        "div",
        { class: "problem" },
        element("b", {}, ...translateToParts("{name}: {title}", { name: element("bdi", {}, name), title })),
        element("p", {}, detail),
      );
      if (hint) box.append(element("p", { class: "muted" }, hint));
      const dismiss = () => {
        if (problems.get(name) === box) problems.delete(name);
        removeItem(box, drop);
      };
      box.append(element("button", { class: "text-button", type: "button", onClick: dismiss }, translate("Dismiss")));
      problems.get(name)?.remove();
      problems.delete(name);
      problems.set(name, box);
      alert.append(box);
      const [[oldest, oldestBox]] = problems;
      if (problems.size > MAX_PROBLEMS) {
        oldestBox.remove();
        problems.delete(oldest);
      }
    },
    clearProblems() {
      problems.clear();
      alert.replaceChildren();
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
