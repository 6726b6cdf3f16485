/** The npm package as its users get it: packed, installed offline, and used by a small program. */
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { build, preview } from "vite";
import { afterAll, beforeAll, expect, test } from "vitest";

import { chromiumPath, launchChromium } from "./browser/chromium";

const WEB = resolve(import.meta.dirname, "..");
const COMPILER = join(WEB, "node_modules/typescript/bin/tsc");

/** Program that uses the package's types. A missing type would make a `@ts-expect-error` fail. */
const PROGRAM = `
import { Access, decodeMotionBlock, deleteProp, JOINTS, listProps, MotionTrack, pack, parseStageAddress, Performer } from "bunraku";
import { Puppeteer, restPose, type StoredProp, uploadProp } from "bunraku";
import { Stage, unpack, Viewer, type Message, type Placement, type Pose, type StageAddress } from "bunraku";
import type { StagedPerformer, ThemePreference } from "bunraku";
import "bunraku/element";
import { BunrakuStage } from "bunraku/element";

const access = new Access("https://stage.example", null);
const viewer = new Viewer({ url: "wss://stage.example/v1/sessions/one/stream", access });
const puppeteer = new Puppeteer({ url: null, viewer });
puppeteer.target(0, 0.1, 0.2, 0.3);
export async function perform(): Promise<void> {
  const performer = await Performer.open({ access, name: "Aiko", place: [1, 0, 0] });
  const isSent: boolean = performer.frame([0, 0.9, 0], restPose().rotations);
  console.log(isSent, performer.session, performer.motion);
  await performer.close();
}
export async function replaceProp(file: File): Promise<StoredProp> {
  const { items } = await listProps({ limit: 1 }, access);
  await deleteProp(items[0].id, access);
  return uploadProp(file, { access, onProgress: (share) => console.log(share.toFixed(2)) });
}
const pose: Pose | null = viewer.poseAt(0);
export const angles: Float64Array = (pose ?? restPose()).rotations;
export const count: number = JOINTS.length;

export function draw(canvas: HTMLCanvasElement, own: number[]): void {
  const stage = new Stage(canvas);
  stage.resize(640, 400, "alone", 2);
  stage.draw([pose], undefined, 1 / 60, own);
  stage.renderer.render(stage.scene, stage.audience.camera);
  stage.dispose();
}

export const element: BunrakuStage = document.createElement("bunraku-stage");
element.src = "https://stage.example/";
element.theme = "auto";
element.addEventListener("welcome", ({ detail }) => console.log(detail.id.toUpperCase(), detail.colour.toFixed(0)));
element.addEventListener("error", ({ detail }) => console.log(detail.toUpperCase()));
element.addEventListener("volumechange", ({ type }) => console.log(type, element.muted, element.volume.toFixed(1)));
element.muted = false;
element.volume = 0.5;
element.seek(element.duration / 2);

export const message: Message | null = unpack(pack({ name: "Claim", limb: 0 }));
export const address: StageAddress | null = parseStageAddress("https://stage.example/", "https://site.example/");
export const theme: ThemePreference = element.theme;
export const placement: Placement | undefined = (undefined as StagedPerformer | undefined)?.placement;
export const block = decodeMotionBlock(MotionTrack.fromDescription({}), new Uint8Array());
block.poseAt(0, restPose());

// @ts-expect-error: no such theme
element.theme = "noon";
// @ts-expect-error: the volume is a number
element.volume = "loud";
// @ts-expect-error: a position is a number
element.seek("half");
// @ts-expect-error: a viewer needs an address
new Viewer({});
// @ts-expect-error: a limb is a number
puppeteer.claim("left hand");
// @ts-expect-error: no such member
element.stage?.scene.children[0].nothing;
`;

let folder: string;

function run(command: string, options: string[], cwd: string): string {
  try {
    return execFileSync(command, options, { cwd, encoding: "utf8", stdio: ["ignore", "pipe", "pipe"] });
  } catch (error) {
    const { stdout, stderr } = error as { stdout: string; stderr: string };
    throw new Error(`${command} ${options.join(" ")}: ${stdout}${stderr}`);
  }
}

beforeAll(() => {
  folder = mkdtempSync(join(tmpdir(), "bunraku-package-"));
  run("npm", ["run", "--silent", "build:package"], WEB);
  const [{ filename }] = JSON.parse(
    run("npm", ["pack", "--silent", "--json", "--pack-destination", folder], join(WEB, "dist")),
  ) as { filename: string }[];
  writeFileSync(join(folder, "package.json"), '{ "private": true, "type": "module" }');
  // three.js is a peer dependency. Without a network, the test uses this project's installation of it.
  run(
    "npm",
    ["install", `./${filename}`, "--offline", "--legacy-peer-deps", "--no-audit", "--no-fund", "--silent"],
    folder,
  );
  symlinkSync(join(WEB, "node_modules/three"), join(folder, "node_modules/three"));
  mkdirSync(join(folder, "node_modules/@types"));
  symlinkSync(join(WEB, "node_modules/@types/three"), join(folder, "node_modules/@types/three"));
  writeFileSync(join(folder, "program.ts"), PROGRAM);
}, 120_000);

afterAll(() => rmSync(folder, { recursive: true, force: true }));

test.each([
  ["bundler", "ESNext"],
  ["nodenext", "NodeNext"],
])(
  "types are found with module resolution %s",
  (resolution, module) => {
    const options = {
      target: "ES2023",
      lib: ["ES2023", "DOM", "DOM.Iterable"],
      module,
      moduleResolution: resolution,
      strict: true,
      noEmit: true,
      skipLibCheck: true,
      types: [],
    };
    writeFileSync(join(folder, "tsconfig.json"), JSON.stringify({ compilerOptions: options, files: ["program.ts"] }));
    expect(run(process.execPath, [COMPILER, "-p", "."], folder)).toBe("");
  },
  60_000,
);

test("package can be loaded without a page, and decodes messages", () => {
  const program = `
    const { JOINTS, pack, unpack, BunrakuStage, MotionTrack } = await import("bunraku");
    const message = unpack(pack({ name: "Claim", limb: 3 }));
    console.log(JSON.stringify([JOINTS.length, message, typeof BunrakuStage, typeof MotionTrack.fromDescription]));`;
  expect(JSON.parse(run(process.execPath, ["--input-type=module", "-e", program], folder))).toEqual([
    18,
    { name: "Claim", limb: 3 },
    "function",
    "function",
  ]);
});

const PAGE = `<!doctype html>
<bunraku-stage src="http://127.0.0.1:9/" theme="day"></bunraku-stage>
<script type="module" src="/page.js"></script>
`;
const PAGE_SCRIPT = `
import { JOINTS } from "bunraku";
import "bunraku/element";
document.title = [JOINTS.length, document.querySelector("bunraku-stage").theme].join(" ");
`;

test.skipIf(!chromiumPath())("package works in a page that Vite builds", { timeout: 90_000 }, async () => {
  writeFileSync(join(folder, "index.html"), PAGE);
  writeFileSync(join(folder, "page.js"), PAGE_SCRIPT);
  const config = { configFile: false, root: folder, logLevel: "error", build: { target: "es2023" } } as const;
  await build(config);
  const [server, browser] = await Promise.all([
    preview({ ...config, preview: { port: 0, host: "127.0.0.1" } }),
    launchChromium(chromiumPath() ?? ""),
  ]);
  try {
    const page = await browser.newPage();
    await page.goto(server.resolvedUrls?.local[0] ?? "");
    await page.waitForFunction("document.title === '18 day'");
  } finally {
    await browser.close();
    await server.close();
  }
});

test("package has metadata and contains only built files", () => {
  const installed = join(folder, "node_modules/bunraku");
  const manifest = JSON.parse(readFileSync(join(installed, "package.json"), "utf8")) as Record<string, unknown>;
  const own = JSON.parse(readFileSync(join(WEB, "package.json"), "utf8")) as { version: string };
  expect(manifest).toMatchObject({ name: "bunraku", version: own.version, type: "module" });
  expect(manifest["dependencies"]).toBeUndefined();
  expect(readFileSync(join(installed, "LICENSES.md"), "utf8")).toContain("@msgpack/msgpack");
  const files = run("npm", ["pack", "--dry-run", "--json", "--silent"], installed);
  const [{ files: packed, size }] = JSON.parse(files) as { files: { path: string }[]; size: number }[];
  expect(
    packed
      .map(({ path }) => path)
      .filter(
        (path) =>
          !/^(package\.json|LICENSE|NOTICE|(README|LICENSES)\.md|bunraku(-stage)?\.js|parts\/.+\.js|types\/.+\.d\.ts)$/.test(
            path,
          ),
      ),
  ).toEqual([]);
  // a quarter of this is the Opus decoder, which only browsers without one load
  expect(size).toBeLessThan(310_000);
});
