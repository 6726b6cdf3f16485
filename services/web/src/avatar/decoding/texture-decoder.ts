/**
 * Decoder of KTX2 textures (Basis Universal) to a format of this machine's graphics processor, in workers of its own.
 */
import { LoadingManager, type WebGLRenderer } from "three";
import transcoderCode from "three/examples/jsm/libs/basis/basis_transcoder.js?raw";
import transcoderUrl from "three/examples/jsm/libs/basis/basis_transcoder.wasm?url";
import { KTX2Loader } from "three/examples/jsm/loaders/KTX2Loader.js";
import { translate } from "../../i18n/translator";
import { AvatarError } from "../error";
import { replaceCodeGeneration } from "./code-generation";

const MAX_WORKERS = 2;

export class TextureDecoder extends KTX2Loader {
  readonly #codeUrl: string;
  #start: Promise<void> | null = null;

  /**
   * `onFailure` is called if a worker fails.
   *
   * @throws AvatarError if the browser has no WebGL 2
   */
  constructor(private readonly onFailure: (error: Error) => void) {
    // The loader's code before it ends without a semicolon.
    const codeUrl = URL.createObjectURL(new Blob([`;(${replaceCodeGeneration})(self);\n`, transcoderCode]));
    const manager = new LoadingManager();
    manager.setURLModifier((url) => (url.endsWith(".js") ? codeUrl : transcoderUrl));
    super(manager);
    this.#codeUrl = codeUrl;
    this.setTranscoderPath("transcoder/");
    this.setWorkerLimit(MAX_WORKERS);
    const context = openContext();
    this.detectSupport({
      extensions: {
        has: (name: string) => context.getExtension(name) !== null,
        get: (name: string) => context.getExtension(name),
      },
    } as unknown as WebGLRenderer);
    context.getExtension("WEBGL_lose_context")?.loseContext();
  }

  override init(): Promise<void> {
    this.#start ??= super.init().then(() => {
      const { workerPool } = this;
      const create = workerPool.workerCreator;
      workerPool.setWorkerCreator(() => {
        const worker = create();
        worker.addEventListener("error", (event) => {
          event.preventDefault();
          this.onFailure(new Error(event.message));
        });
        return worker;
      });
    });
    return this.#start;
  }

  override dispose(): void {
    super.dispose();
    URL.revokeObjectURL(this.#codeUrl);
  }
}

/** Return a context that tells the formats of compressed textures. */
function openContext(): WebGL2RenderingContext {
  // Some browsers have WebGL for canvas elements alone.
  const canvas = typeof document === "undefined" ? new OffscreenCanvas(1, 1) : document.createElement("canvas");
  const context = canvas.getContext("webgl2") as WebGL2RenderingContext | null;
  if (!context)
    throw new AvatarError(
      translate("Unsupported compression"),
      translate("{compression} needs WebGL 2, which this browser does not have", { compression: "KTX2" }),
      translate("Export it without {compression}.", { compression: "KTX2" }),
    );
  return context;
}
