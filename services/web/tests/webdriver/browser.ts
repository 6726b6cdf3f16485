/** Interface of the browsers under test: the part of W3C WebDriver and WebDriver BiDi that the cases use. */

/** Time limit of every wait, in milliseconds. It is generous because the browsers render in software. */
export const WAIT_TIMEOUT_MS = 120_000;
/** Time limit of every command, which may wait in the page. */
export const COMMAND_TIMEOUT_MS = 1.5 * WAIT_TIMEOUT_MS;

/** A browser with its own profile folder. */
export interface Browser {
  /** Open a session, which shares no storage with other sessions. */
  openSession(options?: SessionOptions): Promise<BrowserSession>;
  close(): Promise<void>;
}

export interface SessionOptions {
  /** False: `localStorage` and IndexedDB cannot be used, as where a user blocks site data. */
  hasStorage?: boolean;
  /** Open private windows. */
  isPrivate?: boolean;
}

export interface BrowserSession {
  /** Errors on the consoles of pages and workers, where the browser reports them: WebKitGTK does not. */
  readonly errors: readonly string[];
  /** Folder of downloaded files. */
  readonly downloads: string;
  /** Open a window of `size` at `url`. */
  open(url: string, size?: WindowSize): Promise<BrowserWindow>;
  close(): Promise<void>;
}

export interface WindowSize {
  width: number;
  height: number;
}

export interface BrowserWindow {
  goto(url: string): Promise<void>;
  /** Call the asynchronous function that `declaration` declares with a text, and return the text that it returns. */
  call(declaration: string, argument: string): Promise<string>;
  /** Perform the actions of input devices (W3C WebDriver, 15.2). Keys and buttons stay pressed until released. */
  perform(...devices: InputDevice[]): Promise<void>;
  /** Choose a file in the file input that `selector` matches. */
  chooseFile(selector: string, path: string): Promise<void>;
  /** Return a screenshot as PNG, in base64. */
  screenshot(): Promise<string>;
  close(): Promise<void>;
}

/** Input source of the Actions API, the same in both protocols. */
export type InputDevice =
  | { type: "key"; id: string; actions: KeyAction[] }
  | { type: "pointer"; id: string; parameters: { pointerType: PointerType }; actions: PointerAction[] };

export type PointerType = "mouse" | "touch";
export type KeyAction = { type: "keyDown" | "keyUp"; value: string };
export type PointerAction =
  | { type: "pointerMove"; x: number; y: number }
  | { type: "pointerDown" | "pointerUp"; button: number };
