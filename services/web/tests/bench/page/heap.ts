/** Composition of the heap of a page's thread, from a heap snapshot. */
import type { ThreadProtocol } from "../../browser/engine-protocol";

export interface HeapUsage {
  /** Objects, arrays, closures, strings and numbers of the script, in bytes. */
  objects: number;
  /** Byte code, machine code and type feedback, in bytes. V8 keeps optimising for a long time. */
  code: number;
}

/** The parts of a heap snapshot that are used: `nodes` has one row per node, with the columns `node_fields`. */
interface Snapshot {
  snapshot: { meta: { node_fields: string[]; node_types: [string[], ...unknown[]] } };
  nodes: number[];
}

/** Node types of code. Memory outside the heap (`EXTERNAL_TYPES`) is not counted. */
const CODE_TYPES = new Set(["code", "object shape"]);
const EXTERNAL_TYPES = new Set(["native", "synthetic", "hidden"]);

export async function measureHeap(protocol: ThreadProtocol): Promise<HeapUsage> {
  const chunks: string[] = [];
  const take = ({ chunk }: { chunk: string }) => void chunks.push(chunk);
  protocol.on("HeapProfiler.addHeapSnapshotChunk", take);
  await protocol.send("HeapProfiler.takeHeapSnapshot");
  protocol.off("HeapProfiler.addHeapSnapshotChunk", take);
  return sumHeap(JSON.parse(chunks.join("")) as Snapshot);
}

function sumHeap({ snapshot: { meta }, nodes }: Snapshot): HeapUsage {
  const [types] = meta.node_types;
  const [type, size] = ["type", "self_size"].map((field) => meta.node_fields.indexOf(field));
  const heap: HeapUsage = { objects: 0, code: 0 };
  for (let at = 0; at < nodes.length; at += meta.node_fields.length) {
    const name = types[nodes[at + type]];
    if (!EXTERNAL_TYPES.has(name)) heap[CODE_TYPES.has(name) ? "code" : "objects"] += nodes[at + size];
  }
  return heap;
}
