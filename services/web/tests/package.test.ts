/** The package as somebody has it who installs it: packed, installed without a line, and a small program that uses it. */
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { afterAll, beforeAll, expect, test } from "vitest";

const WEB = resolve(import.meta.dirname, "..");
const COMPILER = join(WEB, "node_modules/typescript/bin/tsc");

/** Every `@ts-expect-error` fails where the type is missing: then anything would do. */
const PROGRAM = `
import { Access, decodeBlock, JOINTS, MotionTrack, pack, Puppeteer, restPose, Stage, unpack, Viewer, type Message, type Pose } from "bunraku";
import "bunraku/element";
import { BunrakuStage } from "bunraku/element";

const viewer = new Viewer({ url: "wss://stage.example/v1/sessions/one/stream", access: new Access("https://stage.example", null) });
const puppeteer = new Puppeteer({ url: null, viewer });
puppeteer.target(0, 0.1, 0.2, 0.3);
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
export const block = decodeBlock(MotionTrack.fromDescription({}), new Uint8Array());
block.at(0, restPose());

// @ts-expect-error: a theme that there is none of
element.theme = "noon";
// @ts-expect-error: how loud is a number
element.volume = "loud";
// @ts-expect-error: seconds are a number
element.seek("half");
// @ts-expect-error: a viewer has to know where to
new Viewer({});
// @ts-expect-error: a limb is claimed by its number
puppeteer.claim("left hand");
// @ts-expect-error: nothing of the kind
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
  // three.js is the installer's to choose; here it is that of this project, as there is no line to fetch one by
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
  "a program that uses it is checked against its types, by the resolution %s",
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

test("it can be loaded where there is no page, and reads what comes over the line", () => {
  const program = `
    const { JOINTS, pack, unpack, BunrakuStage, MotionTrack } = await import("bunraku");
    console.log(JSON.stringify([JOINTS.length, unpack(pack({ name: "Claim", limb: 3 })), typeof BunrakuStage, typeof MotionTrack.fromDescription]));`;
  expect(JSON.parse(run(process.execPath, ["--input-type=module", "-e", program], folder))).toEqual([
    18,
    { name: "Claim", limb: 3 },
    "function",
    "function",
  ]);
});

test("it says what it is, and holds nothing but what is built", () => {
  const installed = join(folder, "node_modules/bunraku");
  const said = JSON.parse(readFileSync(join(installed, "package.json"), "utf8")) as Record<string, unknown>;
  const own = JSON.parse(readFileSync(join(WEB, "package.json"), "utf8")) as { version: string };
  expect(said).toMatchObject({ name: "bunraku", version: own.version, type: "module" });
  expect(said["dependencies"]).toBeUndefined();
  expect(readFileSync(join(installed, "LICENSES.md"), "utf8")).toContain("@msgpack/msgpack");
  const files = run("npm", ["pack", "--dry-run", "--json", "--silent"], installed);
  const [{ files: packed, size }] = JSON.parse(files) as { files: { path: string }[]; size: number }[];
  expect(
    packed
      .map(({ path }) => path)
      .filter(
        (path) =>
          !/^(package\.json|(README|LICENSES)\.md|bunraku(-stage)?\.js|parts\/.+\.js|types\/.+\.d\.ts)$/.test(path),
      ),
  ).toEqual([]);
  // a quarter of it is the decoder for browsers that have none, which no other fetches
  expect(size).toBeLessThan(300_000);
});
