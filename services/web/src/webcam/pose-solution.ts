/**
 * Interface of the WebAssembly module of `@mediapipe/pose`, as far as it is used. The package documents only its own
 * loader, which needs a document and returns every picture; its version is pinned.
 */

/** Texture of the picture to detect, and the time of the picture in microseconds. */
interface TexturePacket {
  readonly glName: number;
  readonly width: number;
  readonly height: number;
  readonly stream: string;
  readonly timestamp: number;
}

/** Change of an option of a calculator of the graph. */
export interface GraphOption {
  readonly calculatorType: string;
  readonly calculatorName: string;
  readonly calculatorIndex: number;
  readonly fieldName: string;
  readonly valueNumber: number;
  readonly valueBoolean: boolean;
  readonly valueString: string;
}

interface Deletable {
  delete(): void;
}

interface List<Item> extends Deletable {
  push_back(item: Item): void;
}

export interface PacketList {
  /** Return a packet of the attached streams: the bytes of a message, or undefined if there is none. */
  get(index: number): Uint8Array | undefined;
}

export interface PoseSolution extends Deletable {
  loadGraph(graph: ArrayBuffer): void;
  /** Provide a file that the graph reads. */
  overrideFile(path: string, content: ArrayBuffer): void;
  changeOptions(options: List<GraphOption>): void;
  attachMultiListener(streams: List<string>, listener: unknown): void;
  /** Run the graph; listeners are called before it returns. */
  send(packets: Deletable): void;
  reset(): void;
}

export interface PoseModule {
  canvas: OffscreenCanvas;
  readonly GL: {
    createContext(canvas: OffscreenCanvas, attributes: object): number;
    makeContextCurrent(context: number): boolean;
  };
  readonly SolutionWasm: new () => PoseSolution;
  readonly PacketDataList: new () => Deletable & { pushTexture2d(packet: TexturePacket): void };
  readonly GraphOptionChangeRequestList: new () => List<GraphOption>;
  readonly StringList: new () => List<string>;
  readonly PacketListener: { implement(listener: { onResults(packets: PacketList): void }): unknown };
  createTexture(): number;
  /** Bind a texture; 0 unbinds. */
  bindTexture2d(texture: number): void;
}

/** Options of the module's constructor. */
export interface PoseModuleOptions {
  readonly wasmBinary: ArrayBuffer;
  print(text: string): void;
  printErr(text: string): void;
}
