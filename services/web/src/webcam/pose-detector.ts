/** Detection of a body in pictures: MediaPipe's BlazePose (lite model), run on the processor of this realm. */
import createPoseModule from "@mediapipe/pose/pose_solution_simd_wasm_bin.js";
import type { DetectedBody } from "./landmark";
import { decodeLandmarkList } from "./landmark-list";
import type { ModelFiles } from "./model-files";
import type { GraphOption, PoseModule, PoseSolution } from "./pose-solution";

const MODEL_FOLDER = "third_party/mediapipe/modules/";
const INPUT_STREAM = "input_frames_gpu";
const OUTPUT_STREAMS = ["pose_landmarks", "world_landmarks"] as const;

const SIDE_PACKET = "ConstantSidePacketCalculator";
/** The lite model, without the graph's own smoothing and without a mask of the person. */
const GRAPH_OPTIONS: readonly (Partial<GraphOption> & Pick<GraphOption, "calculatorType" | "fieldName">)[] = [
  { calculatorType: "InferenceCalculator", fieldName: "use_cpu_inference", valueBoolean: true },
  sidePacket("ModelComplexity", "int_value"),
  sidePacket("SmoothLandmarks", "bool_value"),
  sidePacket("EnableSegmentation", "bool_value"),
  sidePacket("SmoothSegmentation", "bool_value"),
];

/** Return the option that sets a side packet of the graph to zero. */
function sidePacket(name: string, fieldName: string) {
  return { calculatorType: SIDE_PACKET, calculatorName: SIDE_PACKET + name, fieldName };
}

export class PoseDetector {
  readonly #texture: number;
  readonly #context: WebGL2RenderingContext;
  #landmarks: (Uint8Array | undefined)[] = [];
  #lastTimestampUs = -Infinity;

  private constructor(
    private readonly module: PoseModule,
    private readonly solution: PoseSolution,
  ) {
    this.#context = module.canvas.getContext("webgl2") as WebGL2RenderingContext;
    this.#texture = module.createTexture();
  }

  /** Compile the module and load the models. Throws if the browser has no WebGL 2 here, or no WebAssembly with SIMD. */
  static async create(files: ModelFiles): Promise<PoseDetector> {
    const module: PoseModule = await createPoseModule({
      wasmBinary: files.program,
      print: () => undefined,
      printErr: () => undefined,
    });
    module.canvas = new OffscreenCanvas(1, 1);
    const context = module.GL.createContext(module.canvas, { antialias: false, alpha: false, majorVersion: 2 });
    if (!context || !module.GL.makeContextCurrent(context)) throw new Error("WebGL 2 is not available in this worker.");
    const solution = new module.SolutionWasm();
    solution.loadGraph(files.graph);
    solution.overrideFile(`${MODEL_FOLDER}pose_detection/pose_detection.tflite`, files.detector);
    solution.overrideFile(`${MODEL_FOLDER}pose_landmark/pose_landmark_lite.tflite`, files.landmarks);
    const detector = new PoseDetector(module, solution);
    detector.#attachListener();
    detector.#setOptions();
    return detector;
  }

  /** Return the landmarks of the person in a picture; null if there is none. Pictures must be in order of time. */
  detect(picture: ImageBitmap, nowMs: number): DetectedBody | null {
    const { module, solution } = this;
    const gl = this.#context;
    gl.activeTexture(gl.TEXTURE0);
    module.bindTexture2d(this.#texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, picture);
    module.bindTexture2d(0);
    this.#lastTimestampUs = Math.max(Math.round(nowMs * 1000), this.#lastTimestampUs + 1);
    const packets = new module.PacketDataList();
    packets.pushTexture2d({
      glName: this.#texture,
      width: picture.width,
      height: picture.height,
      stream: INPUT_STREAM,
      timestamp: this.#lastTimestampUs,
    });
    this.#landmarks = [];
    solution.send(packets);
    packets.delete();
    const [image, world] = this.#landmarks;
    return image && world ? { image: decodeLandmarkList(image), world: decodeLandmarkList(world) } : null;
  }

  #attachListener(): void {
    const { module } = this;
    const streams = new module.StringList();
    for (const stream of OUTPUT_STREAMS) streams.push_back(stream);
    const listener = module.PacketListener.implement({
      onResults: (packets) => {
        this.#landmarks = OUTPUT_STREAMS.map((_, index) => packets.get(index));
      },
    });
    this.solution.attachMultiListener(streams, listener);
    streams.delete();
  }

  #setOptions(): void {
    const options = new this.module.GraphOptionChangeRequestList();
    for (const option of GRAPH_OPTIONS)
      options.push_back({
        calculatorName: "",
        calculatorIndex: 0,
        valueNumber: 0,
        valueBoolean: false,
        valueString: "",
        ...option,
      });
    this.solution.changeOptions(options);
    options.delete();
  }
}
