/** User interface of the page around the stage: header, panels, transport, name tags and messages. */
import type { MotionQuery } from "../client/api";
import { translate } from "../i18n/translator";
import type { Mapping } from "../input/mapping";
import { createHeader, type Header } from "./header";
import type { AvatarActions } from "./library/avatar-chooser";
import type { RequestDownload } from "./library/download-menu";
import { acceptDrops, createLibraryPanel, type LibraryPanel } from "./library/library-panel";
import type { EditActions } from "./library/motion-editor";
import type { MotionItem } from "./library/motion-item";
import type { CaptureTarget } from "./library/performer-guide";
import { createLinkPanel, type LinkPanel } from "./link/link-panel";
import { createLazyMappingDialog } from "./mapping/lazy-mapping-dialog";
import type { MappingDialog } from "./mapping/mapping-dialog";
import { createMessageArea, type MessageArea } from "./notification/message-area";
import { createNotice, type ShowNotice } from "./notification/notice";
import { createToast, type ToastController } from "./notification/toast";
import { createOccupiedArea } from "./occupied-area";
import { createPanels, type Panels } from "./panel";
import type { LabelMetrics } from "./strings/label-layout";
import { createLimbRequests, type LimbRequests } from "./strings/limb-request";
import { createNameTags, type NameTags } from "./strings/name-tag";
import { createStringsPanel, type StringsActions, type StringsPanel } from "./strings/strings-panel";
import type { SoundActions } from "./transport/sound-control";
import { createTransport, type PanelName, type Transport } from "./transport/transport";
import { PHONE } from "./window-shape";

export interface UserActions extends StringsActions, SoundActions, AvatarActions {
  share(): void;
  /** Switch to the other language. */
  language(): void;
  theme(): void;
  play(): void;
  loop(): void;
  seek(seconds: number): void;
  /** Follow the motion's camera, or stop following it. */
  camera(): void;
  /** Record the performance as a new motion. Omitted if this page may not. */
  keep?(): Promise<void>;
  /** Save a picture of the stage. */
  picture(): void;
  files(files: readonly File[]): void;
  choose(id: string): void;
  download(motion: MotionItem, ...request: Parameters<RequestDownload>): void;
  remove(motion: MotionItem): void;
  /** Add the motion's performers to those on the stage. Omitted if this page may not. */
  add?(motion: MotionItem): void;
  /** Show the motions of a query in the library. */
  search(query: MotionQuery): Promise<void>;
  /** Return where a capture tool performs. Omitted if this page may not perform. */
  captureTarget?(): CaptureTarget;
  /** Change motions of the library. Omitted if this page may not. */
  edits?: EditActions;
  mapping(mapping: Mapping): void;
  /** Called when a panel opened, closed or changed its size: the stage may need another framing. */
  reframe(): void;
  /** Called when the sizes of the labels over the stage, or the space for them, have changed. */
  labels(metrics: LabelMetrics): void;
  /** Called when the dialog of keys and gamepad was opened. */
  mappingShown(): void;
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

/** Create the user interface in `root`. */
export function createPage(root: HTMLElement, actions: UserActions): Page {
  const nameTags = createNameTags(root, actions.ask, actions.labels);
  const { element: noticeElement, notice } = createNotice(root);
  const mappingDialog = createLazyMappingDialog(root, actions.mapping, actions.mappingShown, () =>
    toast(translate("The key settings could not be loaded. Check your connection, then try again")),
  );
  const header = createHeader(root, {
    share: actions.share,
    language: actions.language,
    theme: actions.theme,
    keys: () => mappingDialog.show(),
  });
  const messageArea = createMessageArea(root, noticeElement, () => occupied.invalidate());
  const limbRequests = createLimbRequests(messageArea.element, actions.give);
  const toast = createToast(messageArea.element);
  const library = createLibraryPanel(root, { ...actions, close: () => panels.close("library") });
  const strings = createStringsPanel(root, {
    ...actions,
    close: () => panels.close("strings"),
    keys: () => mappingDialog.show(),
  });
  const link = createLinkPanel(
    root,
    () => panels.close("line"),
    () => toast(translate("The connection panel could not be loaded. Check your connection, then try again")),
  );
  const transport = createTransport(root, { ...actions, panel: (name) => panels.toggle(name) });
  const elements = new Map<PanelName, HTMLElement>([
    ["library", library.panel.element],
    ["strings", strings.panel.element],
    ["line", link.panel.element],
  ]);
  const panels = createPanels(
    elements,
    (name, open) => {
      transport.setExpanded(name, open);
      if (name === "line" && open) link.load();
      if (name === "library" && open) library.load();
      if (name === "strings" && open) strings.load();
      strings.dock.hidden = panels.isOpen("strings") || panels.isSheetOpen;
      occupied.invalidate();
      actions.reframe();
    },
    actions.reframe,
  );
  const occupied = createOccupiedArea(
    [
      ...header.parts,
      ...transport.parts,
      strings.dock,
      ...strings.dock.querySelectorAll("span"),
      ...elements.values(),
      messageArea.element,
    ],
    nameTags.setObstacles,
  );
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
    link,
    mappingDialog,
    nameTags,
    limbRequests,
    panels,
    messageArea,
    toast,
    notice,
  };
}
