/** Everything of the page that is not the stage, put together: one call of `render...` per kind of news. */
import { createHeader, type Header } from "./header";
import { createKeysModal, type KeysModal } from "./keys-modal";
import { acceptDrops, createLibrary, type Library, type Piece } from "./library";
import { createLineCard, type LineCard } from "./line-card";
import { element } from "./dom";
import { createPanels, PHONE, type Panels } from "./panels";
import { createStringsCard, type StringsCard } from "./strings-card";
import { createTags, type Tags } from "./tags";
import { createToast, type Toast } from "./toast";
import { createTransport, type PanelName, type Transport } from "./transport";

export interface PageActions {
  share(): void;
  theme(): void;
  play(): void;
  loop(): void;
  seek(seconds: number): void;
  files(files: readonly File[]): void;
  choose(id: string): void;
  remove(piece: Piece): void;
  toggle(limb: number): void;
  focus(limb: number | null): void;
  /** A panel opened or shut: the stage may have to be framed anew. */
  reframe(): void;
}

export interface Page {
  readonly header: Header;
  readonly transport: Transport;
  readonly library: Library;
  readonly strings: StringsCard;
  readonly line: LineCard;
  readonly keys: KeysModal;
  readonly tags: Tags;
  readonly panels: Panels;
  readonly toast: Toast;
  /** Words on an empty stage; null for none. */
  notice(title: string | null, text?: string): void;
}

export function createPage(root: HTMLElement, on: PageActions): Page {
  const tags = createTags(root);
  const notice = element("div", { class: "notice", role: "status", hidden: true });
  root.append(notice);
  const keys = createKeysModal(root);
  const header = createHeader(root, { share: on.share, theme: on.theme, keys: () => keys.show() });
  const library = createLibrary(root, { files: on.files, choose: on.choose, remove: on.remove, close: () => panels.close("library") });
  const strings = createStringsCard(root, { toggle: on.toggle, focus: on.focus, close: () => panels.close("strings") });
  const line = createLineCard(root, () => panels.close("line"));
  const transport = createTransport(root, { play: on.play, loop: on.loop, seek: on.seek, panel: (name) => panels.toggle(name) });
  const elements = new Map<PanelName, HTMLElement>([
    ["library", library.panel.element],
    ["strings", strings.panel.element],
    ["line", line.panel.element],
  ]);
  const panels = createPanels(elements, (name, open) => {
    transport.expanded(name, open);
    strings.dock(!panels.isOpen("strings") && !panels.sheet);
    on.reframe();
  });
  PHONE.addEventListener("change", () => {
    while (panels.closeLast());
    on.reframe();
  });
  acceptDrops(root, on.files);
  return {
    header, transport, library, strings, line, keys, tags, panels,
    toast: createToast(root),
    notice(title, text = "") {
      notice.hidden = title === null;
      if (title !== null) notice.replaceChildren(element("b", {}, title), text);
    },
  };
}
