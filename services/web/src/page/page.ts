/** Everything of the page that is not the stage, put together: one call of `render...` per kind of news. */
import type { Mapping } from "../input/mapping";
import { createAsks, type Asks } from "./asks";
import { createHeader, type Header } from "./header";
import { createKeys } from "./keys";
import type { DanceAsActions } from "./dance-as";
import type { ChooseFile } from "./downloads";
import type { KeysModal } from "./keys-modal";
import { acceptDrops, createLibrary, type Library, type Piece } from "./library";
import { createLineCard, type LineCard } from "./line-card";
import { createMessages, type Messages } from "./messages";
import { createNotice, type Notice } from "./notice";
import { createOccupied } from "./occupied";
import { createPanels, PHONE, type Panels } from "./panels";
import { createStringsCard, type StringsActions, type StringsCard } from "./strings-card";
import { createTags, type Tags } from "./tags";
import { createToast, type Toasts } from "./toast";
import type { SoundActions } from "./sound-control";
import { createTransport, type PanelName, type Transport } from "./transport";
import { say } from "../words/say";

export interface PageActions extends StringsActions, SoundActions, DanceAsActions {
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
  download(piece: Piece, ...file: Parameters<ChooseFile>): void;
  remove(piece: Piece): void;
  /** Adds who dances in it to those on the stage; left out, that cannot be done here. */
  add?(piece: Piece): void;
  mapping(mapping: Mapping): void;
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
  readonly asks: Asks;
  readonly panels: Panels;
  readonly messages: Messages;
  readonly toast: Toasts;
  readonly notice: Notice;
}

export function createPage(root: HTMLElement, on: PageActions): Page {
  const tags = createTags(root, on.ask, undefined, () => occupied.boxes);
  const { element: noticed, notice } = createNotice(root);
  const keys = createKeys(root, on.mapping, () => toast(say("The list of keys could not be fetched; try again when the line is back")));
  const header = createHeader(root, { share: on.share, language: on.language, theme: on.theme, keys: () => keys.show() });
  const messages = createMessages(root, noticed, () => occupied.moved());
  const asks = createAsks(messages.element, on.give);
  const toast = createToast(messages.element);
  const library = createLibrary(root, { ...on, close: () => panels.close("library") });
  const strings = createStringsCard(root, { ...on, close: () => panels.close("strings"), keys: () => keys.show() });
  const line = createLineCard(root, () => panels.close("line"));
  const transport = createTransport(root, { ...on, panel: (name) => panels.toggle(name) });
  const elements = new Map<PanelName, HTMLElement>([
    ["library", library.panel.element],
    ["strings", strings.panel.element],
    ["line", line.panel.element],
  ]);
  const panels = createPanels(elements, (name, open) => {
    transport.expanded(name, open);
    strings.dock.hidden = panels.isOpen("strings") || panels.sheet;
    on.reframe();
  }, on.reframe);
  const occupied = createOccupied([...header.parts, ...transport.parts, strings.dock, ...elements.values(), messages.element]);
  PHONE.addEventListener("change", () => {
    while (panels.closeLast());
    on.reframe();
  });
  acceptDrops(root, on.files);
  return {
    header, transport, library, strings, line, keys, tags, asks, panels, messages, toast, notice,
  };
}
