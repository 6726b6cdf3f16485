/** Live performer of a test: a figure on the stage of a session, whose samples the test sends. */
import { JOINTS } from "../../src/motion/skeleton";
import { pack } from "../../src/wire/codec";
import { SUBPROTOCOL } from "../../src/wire/messages";
import type { BrowserFixture } from "./browser-suite";

const SAMPLE_INTERVAL_MS = 1000 / 60;
const UNITS_PER_RADIAN = 32767 / Math.PI;

/** Return the rotation vectors (54) and root position of the performance at `seconds`. */
export function danceAt(seconds: number): { root: [number, number, number]; vectors: Float64Array } {
  const vectors = new Float64Array(JOINTS.length * 3);
  const turn = (joint: string, axis: number, angle: number) => {
    vectors[JOINTS.indexOf(joint) * 3 + axis] = angle;
  };
  turn("l_shoulder", 2, 0.9 + 0.4 * Math.sin(1.7 * seconds));
  turn("r_elbow", 0, -0.8 + 0.4 * Math.cos(1.1 * seconds));
  turn("humanoid_root", 1, 0.4 * Math.sin(0.7 * seconds));
  return { root: [0.15 * Math.sin(0.9 * seconds), 0.86, 0], vectors };
}

export interface LivePerformer {
  readonly id: string;
  /** Number on the stage. */
  readonly performer: number;
  /** Send the pose of one instant of the dance from now on. */
  standAt(seconds: number): void;
  /** Send nothing more, and end the performance. */
  end(): Promise<void>;
}

/** Bring a performer on the stage of the fixture's session; it dances at once, by clock time. */
export async function startPerformer(
  fixture: BrowserFixture,
  name: string,
  place: [number, number, number],
): Promise<LivePerformer> {
  const { id, input, performer } = await fixture.request<{ id: string; input: string; performer: number }>(
    "POST",
    "/v1/performers",
    { name, place, session: fixture.session },
  );
  const socket = new WebSocket(fixture.url.replace("http", "ws") + input, SUBPROTOCOL);
  await new Promise<void>((opened, failed) => {
    socket.onopen = () => opened();
    socket.onerror = () => failed(new Error("the performer's socket was not opened"));
  });
  let standing: number | null = null;
  let sequence = 0;
  const timer = setInterval(() => {
    // the test and the server run on one machine, whose clock is the reference clock
    const sampled = Math.round((performance.timeOrigin + performance.now()) * 1000);
    const { root, vectors } = danceAt(standing ?? sampled / 1e6);
    const rotations = Int16Array.from(vectors, (value) => Math.round(value * UNITS_PER_RADIAN));
    socket.send(pack({ name: "Sample", sequence: sequence++, sampled, root, rotations }));
  }, SAMPLE_INTERVAL_MS);
  return {
    id,
    performer,
    standAt: (seconds) => (standing = seconds),
    async end() {
      clearInterval(timer);
      await fixture.request("DELETE", `/v1/performers/${id}`);
      socket.close();
    },
  };
}
