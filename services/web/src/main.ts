/** The only wiring: page, stage, inputs and the session they are about. */
import "./style/page.css";
import { AvatarSlots } from "./app/avatar-slot";
import { addMotionToStage } from "./app/cast";
import { ClaimController } from "./app/claim-controller";
import { Exporter } from "./app/exporter";
import { Invitation } from "./app/invitation";
import { findOrCreateSession, Playback, type PlaybackKind } from "./app/playback";
import { restorePosition, savePosition } from "./app/saved-position";
import { copyShareLink } from "./app/share-link";
import { SoundController } from "./app/sound-controller";
import type { StageController } from "./app/stage-controller";
import { StartupSequence } from "./app/startup";
import { browserSoundPreference } from "./audio/preference";
import { bound, consumeUrlToken, currentRole, may, whenDenied } from "./client/access";
import { type CameraKeyframe, createSession, type Motion, recordSession } from "./client/api";
import { ProblemError } from "./client/problem";
import { loadPageLanguage, switchLanguage } from "./i18n/language";
import { translate } from "./i18n/translator";
import type { GamepadInput } from "./input/gamepad";
import type { LimbController } from "./input/limb-controller";
import { loadMapping, saveMapping } from "./input/mapping-store";
import type { VelocityInputs } from "./input/velocity-input";
import { type Graphics, openGraphics } from "./stage/rendering/graphics";
import type { Stage } from "./stage/stage";
import { FileStore } from "./storage/file-store";
import { browserStorage } from "./storage/web-storage";
import { resolveDisplayName } from "./ui/display-name";
import { isolateBidi } from "./ui/format";
import { isAvatarFile } from "./ui/library/avatar-chooser";
import { MotionList } from "./ui/library/motion-list";
import { showProblem, uploadAll } from "./ui/library/upload";
import { createPage } from "./ui/page";
import { LANDSCAPE_PHONE, PHONE } from "./ui/panel";
import { createTheme, type ThemeChoice } from "./ui/theme";
import { createRecordAction } from "./ui/transport/recording";

const STATISTICS_INTERVAL_MS = 500;

// first of all: the link's token leaves the address
consumeUrlToken();
addEventListener("hashchange", () => consumeUrlToken() && location.reload());
document.documentElement.dataset.role = currentRole();
if (bound()) document.documentElement.dataset.bound = "";
const startup = new StartupSequence(document.documentElement);

const canvas = document.querySelector<HTMLCanvasElement>("#stage") as HTMLCanvasElement;
const query = new URLSearchParams(location.search);
// before anything is said
document.documentElement.lang = await loadPageLanguage(query);
canvas.ariaLabel = translate(
  "A wooden puppet dancing on a stage before a disc of gold leaf. Take its hands and legs with the strings' buttons or the keys 1 to 4.",
);
const reducedMotion = matchMedia("(prefers-reduced-motion: reduce)");
const motionList = new MotionList();
const displayName = resolveDisplayName(query, Math.random());

let stageController: StageController | null = null;
let stage: Stage | null = null;
let hands: LimbController | null = null;
let velocity: VelocityInputs | null = null;
let gamepad: GamepadInput | null = null;
let playback: Playback | null = null;
let focusedLimb: number | null = null;
let theme: ThemeChoice | null = null;
let mapping = loadMapping();

const page = createPage(document.body, {
  share: () => void copyShareLink(playback?.id ?? null, page.toast),
  language: () => {
    if (playback) savePosition(playback, performance.now());
    history.replaceState(history.state, "", switchLanguage(location.href));
    location.reload();
  },
  theme: () => theme?.toggle(),
  play: togglePlaying,
  loop: () => playback?.edit({ loop: !playback.viewer.timeline?.loop }),
  seek: (seconds) => playback?.seek(seconds, performance.now()),
  camera: () => stage?.followMotionCamera(!stage.followsMotionCamera),
  sound: () => soundController.toggle(),
  volume: (volume) => (soundController.volume = volume),
  ...(may("ingest")
    ? {
        keep: createRecordAction({
          record: (session, called) => recordSession(session, { name: called, camera: recordedCameraKeyframes() }),
          toast: (message, ...actions) => page.toast(message, ...actions),
          session: () => playback && { id: playback.id, piece: motionList.find(playback.viewer.motion)?.name ?? "" },
          puppeteer: displayName,
          onRecorded: async () => {
            await motionList.refresh();
            renderMotions();
          },
          play: (motion) => void playMotion(motion),
          showDownloads: (motion) => {
            page.panels.open("library");
            page.library.showDownloads(motion);
          },
        }),
      }
    : {}),
  files: (files) => {
    const own = files.findLast(isAvatarFile);
    if (own) void avatarSlots.selected.load(own);
    const dances = may("ingest") ? files.filter((file) => !isAvatarFile(file)) : [];
    if (own || dances.length > 0) page.panels.open("library");
    void uploadAll(dances, page.library, onMotionUploaded);
  },
  avatar: (file) => void avatarSlots.selected.load(file),
  danceAs: (avatar) => avatarSlots.selected.setActive(avatar),
  removeAvatar: () => void avatarSlots.selected.remove(),
  choose: (id) => void playMotion(id),
  ...(may("ingest") && may("control")
    ? {
        add: (piece) =>
          playback && void addMotionToStage(piece, playback, motionList, page.library).then(renderMotions),
      }
    : {}),
  picture: savePicture,
  download: (...asked) => void exporter.downloadMotion(...asked),
  remove: (piece) => {
    if (confirm(translate('Remove "{name}" from the library?', { name: isolateBidi(piece.name) })))
      void motionList.remove(piece.id).then(renderMotions, (error) => showProblem(page.library, piece.name, error));
  },
  toggle: (limb) => limbController.toggleClaim(limb),
  ask: (limb) => limbController.requestLimb(limb),
  withdraw: (limb) => limbController.withdrawRequest(limb),
  give: (limb) => limbController.handOver(limb),
  select: (limb) => velocity?.hold(limb),
  press: (input, down) => {
    if (down) stageController?.commands.press(`page ${input}`, [input], 1, performance.now());
    else stageController?.commands.release(`page ${input}`, performance.now());
  },
  mapping: (now) => {
    mapping = now;
    saveMapping(now);
    page.mappingDialog.setMapping(now);
    limbController.render();
  },
  focus: (limb) => (focusedLimb = limb),
  dancer: (performer) => limbController.selectedPerformer.select(performer),
  nextDancer: () => limbController.selectNextPerformer(),
  reframe: resizeStage,
});
const exporter = new Exporter(page, () => ({ room: playback, stage }));
const limbController = new ClaimController(page, () => mapping);
limbController.viewOnly = !may("control");
const avatarSlots = new AvatarSlots(
  { page, files: new FileStore("bunraku"), preferences: browserStorage },
  limbController.selectedPerformer,
);
let accessDenied = false;
whenDenied(({ title, detail, hint }) => {
  accessDenied = true;
  page.notice("access", title, hint ? translate("{detail}; {hint}.", { detail, hint }) : detail);
});
const invitation = new Invitation(page.nameTags);
const soundController = new SoundController(
  (state) => page.transport.sound.render(state),
  page.transport.sound.element,
  browserSoundPreference,
);
theme = createTheme((now) => {
  page.header.setTheme(now);
  stage?.setTheme(now);
});

/** What the camera did during the last round of the dance, which is what is kept; nothing where it was not moved. */
function recordedCameraKeyframes(): CameraKeyframe[] {
  const clock = playback?.viewer.clockTime(performance.now()) ?? null;
  return playback && clock !== null
    ? (stage?.cameraRecorder.movedKeyframes(clock - playback.viewer.duration * 1e6) ?? [])
    : [];
}

function savePicture(): void {
  void exporter.savePicture(motionList.find(playback?.viewer.motion ?? null)?.name ?? "");
}

function togglePlaying(): void {
  if (playback?.viewer.timeline) playback.edit({ playing: !playback.viewer.timeline.playing });
}

async function onMotionUploaded(motion: Motion): Promise<void> {
  // it dances also where the list of all did not come: that is asked for again once it does
  await motionList.refresh().then(renderMotions, () => undefined);
  await playMotion(motion.id);
}

/** Puts a dance on the stage: for everyone in the session, or in a session of its own where there is none. */
async function playMotion(id: string): Promise<void> {
  if (!may("control")) return;
  try {
    if (playback) {
      playback.edit({ motion: id, position: 0 });
    } else {
      const session = await createSession(id);
      const entered = openPlayback(session.id);
      if (reducedMotion.matches) entered.edit({ playing: false });
    }
    if (PHONE.matches) page.panels.close("library");
  } catch (error) {
    showProblem(page.library, motionList.find(id)?.name ?? translate("This dance"), error);
  }
}

function renderMotions(): void {
  page.library.renderMotions(motionList.items, playback?.viewer.motion ?? null);
  page.header.setMotionName(motionList.find(playback?.viewer.motion ?? null)?.name ?? "");
}

/** Watches a session, leaving the one before. */
function openPlayback(id: string, kind: PlaybackKind = "sessions"): Playback {
  playback?.close();
  stage?.cameraRecorder.clear();
  playback = new Playback(
    id,
    displayName,
    (error) => {
      page.toast(error instanceof ProblemError ? translate("{title}: {detail}", error) : String(error));
    },
    { kind },
  );
  document.documentElement.toggleAttribute("data-own", kind === "motions");
  const entered = playback;
  const { viewer, puppeteer } = playback;
  limbController.setPlayback(playback);
  stageController?.setPlayback(playback);
  startup.runWhenFinished(() => playback === entered && soundController.setViewer(viewer));
  const url = new URL(location.href);
  url.searchParams.set(kind === "motions" ? "motion" : "session", id);
  history.replaceState(null, "", url);
  page.notice("dance", null);
  page.toast.showDisconnected(null);
  viewer.addEventListener("figure", () => {
    stageController?.updatePerformers();
    avatarSlots.restore(viewer.performers.length);
    if (!motionList.find(viewer.motion)) void motionList.refresh().then(renderMotions, () => undefined);
    renderMotions();
  });
  viewer.addEventListener("tracks", () => {
    stageController?.updatePerformers();
    avatarSlots.restore(viewer.performers.length);
  });
  const renderTimeline = () =>
    page.transport.setTimeline(
      viewer.timeline?.playing ?? false,
      viewer.timeline?.loop ?? false,
      viewer.timeline !== null,
    );
  viewer.addEventListener("timeline", renderTimeline);
  viewer.addEventListener("blocks", () => page.transport.setBlocks(viewer.blocks, viewer.ladder.length));
  const renderPeople = () =>
    startup.runWhenFinished(() => playback === entered && page.header.renderPeople(viewer.presence, puppeteer.id));
  viewer.addEventListener("presence", renderPeople);
  puppeteer.addEventListener("welcome", renderPeople);
  viewer.addEventListener("open", () => {
    limbController.connected = true;
    page.notice("dance", null);
    page.toast.showDisconnected(null);
    limbController.render();
  });
  viewer.addEventListener("closed", (event) => {
    const wasConnected = limbController.connected;
    limbController.connected = false;
    limbController.render();
    const reason = String((event as CustomEvent<string>).detail);
    if (viewer.isClosed || accessDenied) page.toast.showDisconnected(null);
    if (accessDenied) return;
    if (viewer.isClosed)
      page.notice("dance", translate(kind === "motions" ? "The dance has ended" : "The session has ended"), reason);
    else if (wasConnected) page.toast.showDisconnected(translate("The line was lost: {reason}", { reason }));
  });
  renderTimeline();
  renderMotions();
  exposeDebugHandle();
  return playback;
}

function resizeStage(): void {
  const { panels } = page;
  const framing = LANDSCAPE_PHONE.matches
    ? "sideways"
    : !PHONE.matches
      ? "desktop"
      : panels.isSheetOpen
        ? "sheet"
        : "phone";
  stage?.resize(
    innerWidth,
    innerHeight,
    framing,
    devicePixelRatio,
    framing === "desktop" || framing === "sideways" ? panels.sideInsets : [0, 0],
    panels.bottomInset,
  );
}

/** `window.bunraku`: the parts of the running page, for tests and for people who like to look inside. */
function exposeDebugHandle(): void {
  Object.assign(window, {
    bunraku: {
      stage,
      viewer: playback?.viewer ?? null,
      puppeteer: playback?.puppeteer ?? null,
      hands,
      listening: soundController,
    },
  });
}

/** The stage will not come: what waits for the puppet waits no longer. */
function showStageUnavailable(reason: string): void {
  startup.finish();
  page.notice("graphics", translate("This browser cannot draw the stage"), reason);
}

async function openStage(): Promise<void> {
  let graphics: Graphics;
  try {
    graphics = openGraphics(canvas, query.get("quality") === "best");
  } catch {
    showStageUnavailable(translate("It needs WebGL 2. Try another browser, or switch on hardware acceleration."));
    return;
  }
  const theatre = await import("./app/stage-chunk").catch(() => null);
  if (!theatre) {
    showStageUnavailable(translate("What draws it could not be loaded. Load this page again."));
    return;
  }
  const { createGamepad, listenToKeyboard, listenToMouse, Performing } = theatre;
  // what came over the line meanwhile is first: what that asks for is on its way while the stage is built
  await new Promise((done) => setTimeout(done));
  const actions = {
    next_dancer: () => limbController.selectNextPerformer(),
    ask: () => limbController.requestLimb(),
    give: () => limbController.handOver(),
    play: togglePlaying,
    back: () => playback?.seekByBlocks(-1, performance.now()),
    forward: () => playback?.seekByBlocks(1, performance.now()),
    camera: () => stage?.followMotionCamera(!stage.followsMotionCamera),
    sound: () => soundController.toggle(),
    keep: () => page.transport.record(),
    picture: savePicture,
    library: () => page.panels.toggle("library"),
    strings: () => page.panels.toggle("strings"),
    line: () => page.panels.toggle("line"),
  };
  const changed = () => {
    if (hands?.isHoldingAny) invitation.finish();
    limbController.render();
  };
  stageController = new Performing(canvas, limbController, {
    getMapping: () => mapping,
    actions,
    onClaimsChange: changed,
    graphics,
  });
  canvas.addEventListener("webglcontextlost", () =>
    page.notice(
      "graphics",
      translate("The stage went dark"),
      translate("The graphics were taken away; they come back by themselves. If they do not, load the page again."),
    ),
  );
  canvas.addEventListener("webglcontextrestored", () => page.notice("graphics", null));
  const { commands } = stageController;
  ({ stage, hands, velocity } = stageController);
  stage.reducedMotion = reducedMotion.matches;
  reducedMotion.addEventListener("change", () => stage && (stage.reducedMotion = reducedMotion.matches));
  if (theme) stage.setTheme(theme.theme);
  avatarSlots.stage = stage;
  listenToKeyboard(window, commands, velocity, () => mapping, {
    showKeys: () => page.mappingDialog.show(),
    onEscape: () => page.panels.closeLast(),
  });
  listenToMouse(canvas, window, commands, () => mapping);
  gamepad = createGamepad(
    commands,
    () => mapping,
    () => navigator.getGamepads(),
  );
  if (playback) stageController.setPlayback(playback);
  exposeDebugHandle();
  resizeStage();
  addEventListener("resize", resizeStage);
  // hidden, no frame comes that would let up what was pressed
  document.addEventListener("visibilitychange", () => {
    if (document.hidden) stageController?.releaseInputs();
  });
  startup.onStageReady();
  requestAnimationFrame(renderFrame);
}

let lastStatisticsMs = 0;

function renderFrame(): void {
  requestAnimationFrame(renderFrame);
  if (!stage || !stageController) return;
  const now = performance.now();
  const { viewer } = playback ?? {};
  // browsers begin to look for pads when they are asked for them
  if (stage.hasDrawnPerformer || page.mappingDialog.isOpen) gamepad?.update(now, !page.mappingDialog.isCapturing);
  if (page.mappingDialog.isOpen) page.mappingDialog.updateGamepad(gamepad?.pad ?? null);
  const { pose, limbs } = stageController.draw(now, focusedLimb);
  const { faceBoxes: faces } = stage;
  page.nameTags.render(
    limbs,
    pose ? limbs.map((_, limb) => stage?.barBox(limb) ?? null) : [],
    faces,
    now,
    limbController.selectedPerformer.performer,
  );
  page.messageArea.avoidFaces(faces);
  if (pose && !limbController.viewOnly) invitation.update(now, stage);
  if (stage.hasDrawnPerformer) startup.finish();
  page.transport.setCamera(stage.hasMotionCamera, stage.followsMotionCamera);
  if (playback && viewer) page.transport.setPosition(playback.position(now), viewer.duration);
  if (viewer && now - lastStatisticsMs >= STATISTICS_INTERVAL_MS) {
    lastStatisticsMs = now;
    const line = viewer.statistics();
    page.link.addSample(line, viewer.ladder.length);
    page.transport.setHealth(page.link.assessHealth(line, limbController.connected));
  }
  viewer?.recordFrame(performance.now() - now);
}

async function start(): Promise<void> {
  try {
    // The stage waits for no list: the library is read meanwhile.
    const library = motionList.refresh().then(renderMotions);
    const newest = library.then(() => motionList.items[0]?.id ?? null);
    // what fails before these are waited for is told of
    for (const waiting of [library, newest]) waiting.catch(() => undefined);
    const asked = query.get("session");
    const alone = asked ? null : query.get("motion");
    if (asked) openPlayback(asked);
    else if (alone) restorePosition(openPlayback(alone, "motions"));
    const session = asked || alone ? null : await findOrCreateSession(newest);
    if (session) {
      const entered = openPlayback(session.id);
      if (reducedMotion.matches && session.viewers === 0) entered.edit({ playing: false });
    }
    await library;
    if (!playback) startup.finish();
    if (!playback && !may("ingest")) {
      page.notice(
        "dance",
        translate("The stage is empty"),
        translate("Nobody dances here now. Come again when somebody does."),
      );
    } else if (!playback) {
      page.notice(
        "dance",
        translate("The stage is empty"),
        translate("Drop a motion capture file anywhere on this page, or open the library, and the puppet dances it."),
      );
      page.panels.open("library");
    }
  } catch (error) {
    startup.finish();
    if (!(error instanceof ProblemError)) throw error;
    if (!accessDenied)
      page.notice(
        "dance",
        error.title,
        translate("{detail}. {hint}", { detail: error.detail, hint: error.hint ?? "" }),
      );
  }
}

page.mappingDialog.setMapping(mapping);
limbController.render();
page.transport.setHealth("none");
void start();
void openStage();
avatarSlots.restore(1);
