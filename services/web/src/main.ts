/** The only wiring: page, stage, inputs and the session they are about. */
import "./style/page.css";
import { Arriving } from "./arriving";
import { browserSound } from "./audio/preference";
import { Castings } from "./casting";
import { bound, comeIn, may, ownRole, whenDenied } from "./client/access";
import { createSession, keep, type CameraKeyframe, type Motion } from "./client/library";
import { ProblemError } from "./client/problem";
import { Exporting } from "./exporting";
import { Holding } from "./holding";
import type { GamepadInput } from "./input/gamepad";
import type { Hands } from "./input/hands";
import { loadMapping, saveMapping } from "./input/mapping-store";
import type { VelocityInputs } from "./input/velocity";
import { Inviting } from "./inviting";
import { addToStage } from "./joining";
import { goOn, leave } from "./left";
import { Listening } from "./listening";
import { isAvatar } from "./page/dance-as";
import { isolated } from "./page/format";
import { keepThis } from "./page/keep";
import { ownName } from "./page/name";
import { createPage } from "./page/page";
import { PHONE, SIDEWAYS } from "./page/panels";
import { Pieces } from "./page/pieces";
import { createTheme, type ThemeChoice } from "./page/theme";
import { tell, uploadAll } from "./page/uploads";
import type { Performing } from "./performing";
import { findSession, Room, type Place } from "./room";
import { share } from "./sharing";
import { openGraphics, type Graphics } from "./stage/graphics";
import type { Stage } from "./stage/stage";
import { FileStore } from "./storage/files";
import { browserStore } from "./storage/store";
import { chooseOther, learnLanguage } from "./words/language";
import { say } from "./words/say";

const SAMPLE_EVERY = 500;

// first of all: the link's token leaves the address
comeIn();
addEventListener("hashchange", () => comeIn() && location.reload());
document.documentElement.dataset.role = ownRole();
if (bound()) document.documentElement.dataset.bound = "";
const arriving = new Arriving(document.documentElement);

const canvas = document.querySelector<HTMLCanvasElement>("#stage") as HTMLCanvasElement;
const query = new URLSearchParams(location.search);
// before anything is said
document.documentElement.lang = await learnLanguage(query);
canvas.ariaLabel = say("A wooden puppet dancing on a stage before a disc of gold leaf. Take its hands and legs with the strings' buttons or the keys 1 to 4.");
const calm = matchMedia("(prefers-reduced-motion: reduce)");
const pieces = new Pieces();
const name = ownName(query, Math.random());

let performing: Performing | null = null;
let stage: Stage | null = null;
let hands: Hands | null = null;
let velocity: VelocityInputs | null = null;
let pad: GamepadInput | null = null;
let room: Room | null = null;
let focused: number | null = null;
let theme: ThemeChoice | null = null;
let mapping = loadMapping();

const page = createPage(document.body, {
  share: () => void share(room?.id ?? null, page.toast),
  language: () => {
    if (room) leave(room, performance.now());
    history.replaceState(history.state, "", chooseOther(location.href));
    location.reload();
  },
  theme: () => theme?.toggle(),
  play,
  loop: () => room?.edit({ loop: !room.viewer.timeline?.loop }),
  seek: (seconds) => room?.seek(seconds, performance.now()),
  camera: () => stage?.follow(!stage.following),
  sound: () => listening.toggle(),
  volume: (volume) => (listening.volume = volume),
  ...(may("ingest") ? { keep: keepThis({
    keep: (session, called) => keep(session, { name: called, camera: cameraMoves() }),
    toast: (message, ...actions) => page.toast(message, ...actions),
    session: () => room && { id: room.id, piece: pieces.find(room.viewer.motion)?.name ?? "" },
    puppeteer: name,
    kept: async () => {
      await pieces.refresh();
      renderPieces();
    },
    choose: (motion) => void choose(motion),
    download: (motion) => {
      page.panels.open("library");
      page.library.disclose(motion);
    },
  }) } : {}),
  files: (files) => {
    const own = files.findLast(isAvatar);
    if (own) void castings.chosen.take(own);
    const dances = may("ingest") ? files.filter((file) => !isAvatar(file)) : [];
    if (own || dances.length > 0) page.panels.open("library");
    void uploadAll(dances, page.library, uploaded);
  },
  avatar: (file) => void castings.chosen.take(file),
  danceAs: (avatar) => castings.chosen.choose(avatar),
  removeAvatar: () => void castings.chosen.remove(),
  choose: (id) => void choose(id),
  ...(may("ingest") && may("control") ? { add: (piece) => room && void addToStage(piece, room, pieces, page.library).then(renderPieces) } : {}),
  picture,
  download: (...asked) => void exporting.download(...asked),
  remove: (piece) => {
    if (confirm(say("Remove \"{name}\" from the library?", { name: isolated(piece.name) }))) void pieces.remove(piece.id).then(renderPieces, (error) => tell(page.library, piece.name, error));
  },
  toggle: (limb) => holding.toggle(limb),
  ask: (limb) => holding.ask(limb),
  withdraw: (limb) => holding.withdraw(limb),
  give: (limb) => holding.give(limb),
  select: (limb) => velocity?.hold(limb),
  press: (input, down) => {
    if (down) performing?.commands.press(`page ${input}`, [input], 1, performance.now());
    else performing?.commands.release(`page ${input}`, performance.now());
  },
  mapping: (now) => {
    mapping = now;
    saveMapping(now);
    page.keys.mapping(now);
    holding.render();
  },
  focus: (limb) => (focused = limb),
  dancer: (performer) => holding.chosen.choose(performer),
  nextDancer: () => holding.nextDancer(),
  reframe: resize,
});
const exporting = new Exporting(page, () => ({ room, stage }));
const holding = new Holding(page, () => mapping);
holding.watching = !may("control");
const castings = new Castings({ page, files: new FileStore("bunraku"), choices: browserStore }, holding.chosen);
let denied = false;
whenDenied(({ title, detail, hint }) => {
  denied = true;
  page.notice("access", title, hint ? say("{detail}; {hint}.", { detail, hint }) : detail);
});
const inviting = new Inviting(page.tags);
const listening = new Listening((state) => page.transport.sound.render(state), page.transport.sound.element, browserSound);
theme = createTheme((now) => {
  page.header.theme(now);
  stage?.setTheme(now);
});

/** What the camera did during the last round of the dance, which is what is kept; nothing where it was not moved. */
function cameraMoves(): CameraKeyframe[] {
  const clock = room?.viewer.clockTime(performance.now()) ?? null;
  return room && clock !== null ? (stage?.trail.moves(clock - room.viewer.duration * 1e6) ?? []) : [];
}

function picture(): void {
  void exporting.picture(pieces.find(room?.viewer.motion ?? null)?.name ?? "");
}

function play(): void {
  if (room?.viewer.timeline) room.edit({ playing: !room.viewer.timeline.playing });
}

async function uploaded(motion: Motion): Promise<void> {
  // it dances also where the list of all did not come: that is asked for again once it does
  await pieces.refresh().then(renderPieces, () => undefined);
  await choose(motion.id);
}

/** Puts a dance on the stage: for everyone in the session, or in a session of its own where there is none. */
async function choose(id: string): Promise<void> {
  if (!may("control")) return;
  try {
    if (room) {
      room.edit({ motion: id, position: 0 });
    } else {
      const session = await createSession(id);
      const entered = enter(session.id);
      if (calm.matches) entered.edit({ playing: false });
    }
    if (PHONE.matches) page.panels.close("library");
  } catch (error) {
    tell(page.library, pieces.find(id)?.name ?? say("This dance"), error);
  }
}

function renderPieces(): void {
  page.library.pieces(pieces.all, room?.viewer.motion ?? null);
  page.header.piece(pieces.find(room?.viewer.motion ?? null)?.name ?? "");
}

/** Watches a session, leaving the one before. */
function enter(id: string, place: Place = "sessions"): Room {
  room?.close();
  stage?.trail.clear();
  room = new Room(id, name, (error) => {
    page.toast(error instanceof ProblemError ? say("{title}: {detail}", error) : String(error));
  }, { place });
  document.documentElement.toggleAttribute("data-own", place === "motions");
  const entered = room;
  const { viewer, puppeteer } = room;
  holding.enter(room);
  performing?.enter(room);
  arriving.after(() => room === entered && listening.enter(viewer));
  const url = new URL(location.href);
  url.searchParams.set(place === "motions" ? "motion" : "session", id);
  history.replaceState(null, "", url);
  page.notice("dance", null);
  page.toast.lost(null);
  viewer.addEventListener("figure", () => {
    performing?.comeOn();
    castings.restore(viewer.performers.length);
    if (!pieces.find(viewer.motion)) void pieces.refresh().then(renderPieces, () => undefined);
    renderPieces();
  });
  viewer.addEventListener("tracks", () => {
    performing?.comeOn();
    castings.restore(viewer.performers.length);
  });
  const renderTimeline = () => page.transport.timeline(viewer.timeline?.playing ?? false, viewer.timeline?.loop ?? false, viewer.timeline !== null);
  viewer.addEventListener("timeline", renderTimeline);
  viewer.addEventListener("blocks", () => page.transport.blocks(viewer.blocks, viewer.rates.length));
  const renderPeople = () => arriving.after(() => room === entered && page.header.people(viewer.presence, puppeteer.id));
  viewer.addEventListener("presence", renderPeople);
  puppeteer.addEventListener("welcome", renderPeople);
  viewer.addEventListener("open", () => {
    holding.connected = true;
    page.notice("dance", null);
    page.toast.lost(null);
    holding.render();
  });
  viewer.addEventListener("closed", (event) => {
    const wasConnected = holding.connected;
    holding.connected = false;
    holding.render();
    const reason = String((event as CustomEvent<string>).detail);
    if (viewer.ended || denied) page.toast.lost(null);
    if (denied) return;
    if (viewer.ended) page.notice("dance", say(place === "motions" ? "The dance has ended" : "The session has ended"), reason);
    else if (wasConnected) page.toast.lost(say("The line was lost: {reason}", { reason }));
  });
  renderTimeline();
  renderPieces();
  expose();
  return room;
}

function resize(): void {
  const { panels } = page;
  const framing = SIDEWAYS.matches ? "sideways" : !PHONE.matches ? "desktop" : panels.sheet ? "sheet" : "phone";
  stage?.resize(innerWidth, innerHeight, framing, devicePixelRatio, framing === "desktop" || framing === "sideways" ? panels.sides : [0, 0], panels.below);
}

/** `window.bunraku`: the parts of the running page, for tests and for people who like to look inside. */
function expose(): void {
  Object.assign(window, { bunraku: { stage, viewer: room?.viewer ?? null, puppeteer: room?.puppeteer ?? null, hands, listening } });
}

/** The stage will not come: what waits for the puppet waits no longer. */
function withoutStage(why: string): void {
  arriving.arrived();
  page.notice("graphics", say("This browser cannot draw the stage"), why);
}

async function openStage(): Promise<void> {
  let graphics: Graphics;
  try {
    graphics = openGraphics(canvas, query.get("quality") === "best");
  } catch {
    withoutStage(say("It needs WebGL 2. Try another browser, or switch on hardware acceleration."));
    return;
  }
  const theatre = await import("./theatre").catch(() => null);
  if (!theatre) {
    withoutStage(say("What draws it could not be loaded. Load this page again."));
    return;
  }
  const { createGamepad, listenToKeyboard, listenToMouse, Performing } = theatre;
  // what came over the line meanwhile is first: what that asks for is on its way while the stage is built
  await new Promise((done) => setTimeout(done));
  const actions = {
    next_dancer: () => holding.nextDancer(),
    ask: () => holding.ask(),
    give: () => holding.give(),
    play,
    back: () => room?.step(-1, performance.now()),
    forward: () => room?.step(1, performance.now()),
    camera: () => stage?.follow(!stage.following),
    sound: () => listening.toggle(),
    keep: () => page.transport.keep(),
    picture,
    library: () => page.panels.toggle("library"),
    strings: () => page.panels.toggle("strings"),
    line: () => page.panels.toggle("line"),
  };
  const changed = () => {
    if (hands?.any) inviting.end();
    holding.render();
  };
  performing = new Performing(canvas, holding, { mapping: () => mapping, actions, changed, graphics });
  canvas.addEventListener("webglcontextlost", () => page.notice("graphics", say("The stage went dark"), say("The graphics were taken away; they come back by themselves. If they do not, load the page again.")));
  canvas.addEventListener("webglcontextrestored", () => page.notice("graphics", null));
  const { commands } = performing;
  ({ stage, hands, velocity } = performing);
  stage.still = calm.matches;
  calm.addEventListener("change", () => stage && (stage.still = calm.matches));
  if (theme) stage.setTheme(theme.theme);
  castings.stage = stage;
  listenToKeyboard(window, commands, velocity, () => mapping, { keys: () => page.keys.show(), escape: () => page.panels.closeLast() });
  listenToMouse(canvas, window, commands, () => mapping);
  pad = createGamepad(commands, () => mapping, () => navigator.getGamepads());
  if (room) performing.enter(room);
  expose();
  resize();
  addEventListener("resize", resize);
  // hidden, no frame comes that would let up what was pressed
  document.addEventListener("visibilitychange", () => {
    if (document.hidden) performing?.rest();
  });
  arriving.staged();
  requestAnimationFrame(frame);
}

let sampled = 0;

function frame(): void {
  requestAnimationFrame(frame);
  if (!stage || !performing) return;
  const now = performance.now();
  const { viewer } = room ?? {};
  // browsers begin to look for pads when they are asked for them
  if (stage.shown || page.keys.open) pad?.update(now, !page.keys.listening);
  if (page.keys.open) page.keys.pad(pad?.pad ?? null);
  const { pose, limbs } = performing.draw(now, focused);
  const { faces } = stage;
  page.tags.render(limbs, pose ? limbs.map((_, limb) => stage?.bar(limb) ?? null) : [], faces, now, holding.chosen.performer);
  page.messages.keepOff(faces);
  if (pose && !holding.watching) inviting.update(now, stage);
  if (stage.shown) arriving.arrived();
  page.transport.camera(stage.hasShow, stage.following);
  if (room && viewer) page.transport.position(room.position(now), viewer.duration);
  if (viewer && now - sampled >= SAMPLE_EVERY) {
    sampled = now;
    const line = viewer.line();
    page.line.sample(line, viewer.rates.length);
    page.transport.health(page.line.health(line, holding.connected));
  }
  viewer?.drawn(performance.now() - now);
}

async function start(): Promise<void> {
  try {
    // The stage waits for no list: the library is read meanwhile.
    const library = pieces.refresh().then(renderPieces);
    const newest = library.then(() => pieces.all[0]?.id ?? null);
    // what fails before these are waited for is told of
    for (const waiting of [library, newest]) waiting.catch(() => undefined);
    const asked = query.get("session");
    const alone = asked ? null : query.get("motion");
    if (asked) enter(asked);
    else if (alone) goOn(enter(alone, "motions"));
    const session = asked || alone ? null : await findSession(newest);
    if (session) {
      const entered = enter(session.id);
      if (calm.matches && session.viewers === 0) entered.edit({ playing: false });
    }
    await library;
    if (!room) arriving.arrived();
    if (!room && !may("ingest")) {
      page.notice("dance", say("The stage is empty"), say("Nobody dances here now. Come again when somebody does."));
    } else if (!room) {
      page.notice("dance", say("The stage is empty"), say("Drop a motion capture file anywhere on this page, or open the library, and the puppet dances it."));
      page.panels.open("library");
    }
  } catch (error) {
    arriving.arrived();
    if (!(error instanceof ProblemError)) throw error;
    if (!denied) page.notice("dance", error.title, say("{detail}. {hint}", { detail: error.detail, hint: error.hint ?? "" }));
  }
}

page.keys.mapping(mapping);
holding.render();
page.transport.health("none");
void start();
void openStage();
castings.restore(1);
