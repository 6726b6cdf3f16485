/** What a page's heap is made of, out of a snapshot of it. */
import type { CDPSession } from "playwright-core";

export interface HeapUsage {
  /** What the page's script made and holds: objects, arrays, closures, strings and numbers. Bytes. */
  objects: number;
  /**
   * What V8 made of the script, and goes on making better for long: byte code, machine code and what it noted for them.
   * Bytes.
   */
  code: number;
}

/** As far as it is read: `nodes` has a row of numbers for each, of which `node_fields` names the columns. */
interface Snapshot {
  snapshot: { meta: { node_fields: string[]; node_types: [string[], ...unknown[]] } };
  nodes: number[];
}

/** Types of V8's that are code; the browser's own, outside of the heap, are counted nowhere. */
const CODE_TYPES = new Set(["code", "object shape"]);
const EXTERNAL_TYPES = new Set(["native", "synthetic", "hidden"]);

export async function measureHeap(protocol: CDPSession): Promise<HeapUsage> {
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
