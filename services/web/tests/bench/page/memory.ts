/** Case `memory`: growth of the heap over half an hour of use. */
import { execFileSync } from "node:child_process";
import { existsSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import type { CDPSession, Page } from "playwright-core";
import { collectGarbage, openThreadProtocols, type ThreadProtocol } from "../../browser/engine-protocol";
import {
  LEFT_HAND,
  ringPosition,
  waitForFirstPose,
  waitForHold,
  waitForRelease,
  waitForWelcome,
  waitUntilSettled,
} from "../../browser/page-probe";
import { sharedClipFolder } from "../../browser/server";
import { type BenchContext, type BenchFigures, roundTo, withPage } from "./bench";
import { type HeapUsage, measureHeap } from "./heap";

const REPOSITORY = resolve(import.meta.dirname, "../../../../..");
/** Rounds before the first measurement, in which one-time allocations happen. */
const WARM_UP_ROUNDS = 3;
/** Rounds between samples of the heap's size, which show whether it keeps growing. */
const NOTE_EVERY_ROUNDS = 5;

interface MemoryUsage extends HeapUsage {
  bytes: number;
  nodes: number;
  listeners: number;
}

/** Run the case `memory`. */
export async function benchMemory(bench: BenchContext): Promise<BenchFigures> {
  const folder = mkdtempSync(join(tmpdir(), "bunraku-bench-"));
  try {
    const clip = findClip(folder);
    return await withPage(bench, {}, async ({ page, protocol }) => {
      page.on("dialog", (dialog) => void dialog.accept());
      await page.goto(bench.url);
      await waitForFirstPose(page);
      await waitForWelcome(page);
      for (let nth = 0; nth < WARM_UP_ROUNDS; nth++) await playRound(page, clip);
      const threads = await openThreadProtocols(page);
      const before = await measureMemory(protocol, threads);
      const end = performance.now() + bench.minutes * 60_000;
      let rounds = 0;
      const heaps: number[] = [];
      for (; performance.now() < end; rounds++) {
        await playRound(page, clip);
        if (rounds % NOTE_EVERY_ROUNDS === 0) heaps.push(roundTo((await usedHeapBytes(threads)) / 1e6, 2));
      }
      const after = await measureMemory(protocol, threads);
      bench.note(
        `memory: ${rounds} rounds in ${bench.minutes} minutes, ` +
          `heap ${roundTo(before.bytes / 1e6, 2)} to ${roundTo(after.bytes / 1e6, 2)} MB, ` +
          `nodes ${before.nodes} to ${after.nodes}, listeners ${before.listeners} to ${after.listeners}`,
      );
      bench.note(`memory: heap after every ${NOTE_EVERY_ROUNDS} rounds, MB: ${heaps.join(", ")}`);
      return {
        heap_growth_mb: roundTo((after.bytes - before.bytes) / 1e6, 2),
        heap_growth_objects_mb: roundTo((after.objects - before.objects) / 1e6, 2),
        heap_growth_code_mb: roundTo((after.code - before.code) / 1e6, 2),
        node_growth: after.nodes - before.nodes,
        listener_growth: after.listeners - before.listeners,
        memory_rounds: rounds,
      };
    });
  } finally {
    rmSync(folder, { recursive: true, force: true });
  }
}

/** Return the path of a recorded clip if there is one, or else of the demo's motion as a BVH file. */
function findClip(folder: string): string {
  const shared = join(sharedClipFolder() ?? folder, "mocap/bvh/mass_walk.bvh");
  if (existsSync(shared)) return shared;
  const demoClip = join(folder, "own.bvh");
  const script = [
    "import sys",
    "from bunraku.demo.choreography import animate_dance",
    "from bunraku.motion.bvh_writer import write_bvh",
    "sys.stdout.buffer.write(write_bvh(animate_dance()))",
  ].join("; ");
  writeFileSync(demoClip, execFileSync(join(REPOSITORY, ".venv/bin/python"), ["-c", script], { maxBuffer: 1 << 26 }));
  return demoClip;
}

/** Return the size of the heaps of all threads after a garbage collection, in bytes. */
async function usedHeapBytes(threads: readonly ThreadProtocol[]): Promise<number> {
  await collectGarbage(threads);
  let bytes = 0;
  for (const thread of threads) bytes += (await thread.send("Runtime.getHeapUsage")).usedSize;
  return bytes;
}

/** Measure the memory in use after a garbage collection. */
async function measureMemory(protocol: CDPSession, threads: readonly ThreadProtocol[]): Promise<MemoryUsage> {
  const bytes = await usedHeapBytes(threads);
  const { nodes, jsEventListeners: listeners } = await protocol.send("Memory.getDOMCounters");
  const usage = { bytes, nodes, listeners, objects: 0, code: 0 };
  for (const thread of threads) {
    const { objects, code } = await measureHeap(thread);
    usage.objects += objects;
    usage.code += code;
  }
  return usage;
}

/** Use every function of the page once and restore its initial state. */
async function playRound(page: Page, clip: string): Promise<void> {
  const press = (name: string) => page.getByRole("button", { name, exact: true }).click();
  await press("Pause");
  await page.getByRole("button", { name: "Play", exact: true }).waitFor();
  const ring = await waitUntilSettled(page, () => ringPosition(page, LEFT_HAND), 0.5);
  await page.mouse.move(ring.x, ring.y);
  await page.mouse.down();
  await page.mouse.move(ring.x + 40, ring.y + 40, { steps: 8 });
  await waitForHold(page, LEFT_HAND);
  await page.mouse.up();
  await waitForRelease(page, LEFT_HAND);
  await press("Play");
  await page.keyboard.press("Digit2");
  await waitForHold(page, LEFT_HAND);
  await page.keyboard.press("KeyW", { delay: 300 });
  await page.keyboard.press("Escape");
  await waitForRelease(page, LEFT_HAND);
  for (const panel of ["Strings", "Connection"]) {
    await press(panel);
    await page.getByRole("complementary", { name: panel }).waitFor();
    await press(`Close ${panel.toLowerCase()}`);
  }
  await page.keyboard.press("Shift+Slash");
  await page.getByRole("dialog", { name: "Keys and gamepad" }).waitFor();
  await page.keyboard.press("Escape");
  await page.getByRole("slider", { name: "Seek" }).press("Home");
  for (const theme of ["Light theme", "Dark theme"]) await press(theme);
  // Upload a motion, play it and remove it.
  const before = await page.locator(".brand-piece").innerText();
  await page.locator('input[type=file][accept*=".bvh"]').setInputFiles(clip);
  await page.waitForFunction((before) => document.querySelector(".brand-piece")?.textContent !== before, before);
  await waitForFirstPose(page);
  const name = await page.locator(".brand-piece").innerText();
  // beside the tools of the entry, which cover its middle while the mouse is over it
  await page.locator(".motion", { hasText: before }).click({ position: { x: 30, y: 20 } });
  await page.waitForFunction((before) => document.querySelector(".brand-piece")?.textContent === before, before);
  await waitForFirstPose(page);
  await page.getByRole("button", { name: `Remove ${name}` }).focus();
  await page.keyboard.press("Enter");
  await page.locator(".motion", { hasText: name }).waitFor({ state: "detached" });
  await press("Close library");
}
