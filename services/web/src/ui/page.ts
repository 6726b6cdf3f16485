/** Everything of the page that is not the stage, put together: one call of `render...` per kind of news. */

import { translate } from "../i18n/translator";
import type { Mapping } from "../input/mapping";
import { createHeader, type Header } from "./header";
import type { AvatarActions } from "./library/avatar-chooser";
import type { RequestDownload } from "./library/download-menu";
import { acceptDrops, createLibraryPanel, type LibraryPanel, type MotionItem } from "./library/library-panel";
import { createLinkPanel, type LinkPanel } from "./link/link-panel";
import { createLazyMappingDialog } from "./mapping/lazy-mapping-dialog";
import type { MappingDialog } from "./mapping/mapping-dialog";
import { createMessageArea, type MessageArea } from "./notification/message-area";
import { createNotice, type ShowNotice } from "./notification/notice";
import { createToast, type ToastController } from "./notification/toast";
import { createOccupiedArea } from "./occupied-area";
import { createPanels, type Panels, PHONE } from "./panel";
import { createLimbRequests, type LimbRequests } from "./strings/limb-request";
import { createNameTags, type NameTags } from "./strings/name-tag";
import { createStringsPanel, type StringsActions, type StringsPanel } from "./strings/strings-panel";
import type { SoundActions } from "./transport/sound-control";
import { createTransport, type PanelName, type Transport } from "./transport/transport";

export interface UserActions extends StringsActions, SoundActions, AvatarActions {
  share(): void;
  /** Speaks the other language. */
  language(): void;
  theme(): void;
  play(): void;
  loop(): void;
  seek(seconds: number): void;
  /** Follows the show's camera, or no longer. */
  camera(): void;
  /** Keeps the performance as a new motion; left out, it cannot be kept here. */
  keep?(): Promise<void>;
  /** Saves a picture of the stage. */
  picture(): void;
  files(files: readonly File[]): void;
  choose(id: string): void;
  download(piece: MotionItem, ...file: Parameters<RequestDownload>): void;
  remove(piece: MotionItem): void;
  /** Adds who dances in it to those on the stage; left out, that cannot be done here. */
  add?(piece: MotionItem): void;
  mapping(mapping: Mapping): void;
  /** A panel opened or shut: the stage may have to be framed anew. */
  reframe(): void;
}

export interface Page {
  readonly header: Header;
  readonly transport: Transport;
  readonly library: LibraryPanel;
  readonly strings: StringsPanel;
  readonly link: LinkPanel;
  readonly mappingDialog: MappingDialog;
  readonly nameTags: NameTags;
  readonly limbRequests: LimbRequests;
  readonly panels: Panels;
  readonly messageArea: MessageArea;
  readonly toast: ToastController;
  readonly notice: ShowNotice;
}

export function createPage(root: HTMLElement, actions: UserActions): Page {
  const tags = createNameTags(root, actions.ask, undefined, () => occupied.boxes);
  const { element: noticed, notice } = createNotice(root);
  const keys = createLazyMappingDialog(root, actions.mapping, () =>
    toast(translate("The list of keys could not be fetched; try again when the line is back")),
  );
  const header = createHeader(root, {
    share: actions.share,
    language: actions.language,
    theme: actions.theme,
    keys: () => keys.show(),
  });
  const messages = createMessageArea(root, noticed, () => occupied.invalidate());
  const asks = createLimbRequests(messages.element, actions.give);
  const toast = createToast(messages.element);
  const library = createLibraryPanel(root, { ...actions, close: () => panels.close("library") });
  const strings = createStringsPanel(root, {
    ...actions,
    close: () => panels.close("strings"),
    keys: () => keys.show(),
  });
  const line = createLinkPanel(root, () => panels.close("line"));
  const transport = createTransport(root, { ...actions, panel: (name) => panels.toggle(name) });
  const elements = new Map<PanelName, HTMLElement>([
    ["library", library.panel.element],
    ["strings", strings.panel.element],
    ["line", line.panel.element],
  ]);
  const panels = createPanels(
    elements,
    (name, open) => {
      transport.setExpanded(name, open);
      strings.dock.hidden = panels.isOpen("strings") || panels.isSheetOpen;
      actions.reframe();
    },
    actions.reframe,
  );
  const occupied = createOccupiedArea([
    ...header.parts,
    ...transport.parts,
    strings.dock,
    ...elements.values(),
    messages.element,
  ]);
  PHONE.addEventListener("change", () => {
    while (panels.closeLast());
    actions.reframe();
  });
  acceptDrops(root, actions.files);
  return {
    header,
    transport,
    library,
    strings,
    link: line,
    mappingDialog: keys,
    nameTags: tags,
    limbRequests: asks,
    panels,
    messageArea: messages,
    toast,
    notice,
  };
}
