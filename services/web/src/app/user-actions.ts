/** Actions of the page's controls and of its keys, as functions of the application's parts. */

import { pageAccess } from "../client/access";
import { editSession, recordSession } from "../client/api";
import { ProblemError } from "../client/problem";
import { switchLanguage } from "../i18n/language";
import { translate } from "../i18n/translator";
import type { PageActions } from "../input/command-dispatcher";
import type { Mapping } from "../input/mapping";
import type { CrowdActions } from "../ui/crowd/crowd-controls";
import type { EditActions } from "../ui/library/motion-editor";
import type { CaptureTarget } from "../ui/library/performer-guide";
import { showProblem } from "../ui/library/problem-report";
import type { Page, UserActions } from "../ui/page";
import type { PropActions } from "../ui/strings/prop-section";
import type { ThemeChoice } from "../ui/theme";
import { createRecordAction, type KeptMotionActions, showKept } from "../ui/transport/recording";
import type { AvatarSlots } from "./avatar-slot";
import { addMotionToStage } from "./cast";
import type { Exporter } from "./exporter";
import { type FileKind, findFileKind } from "./file-kind";
import type { LibraryController } from "./library-controller";
import type { LimbControls } from "./limb-controls";
import { createEditedMotion } from "./motion-edit";
import type { PlaybackController } from "./playback-controller";
import { createPropActions, moveNearestProp, type PropContext } from "./prop-actions";
import type { RemotePlayback } from "./remote-playback";
import { savePosition } from "./saved-position";
import { copyShareLink, createShareLink } from "./share-link";
import type { SoundController } from "./sound-controller";
import type { StageHost } from "./stage-host";
import type { UploadTarget } from "./upload-controller";
import type { WebcamStage } from "./webcam-controller";

/** Parts of the application that actions use. An action reads them when it runs: the page is built before them. */
export interface AppParts {
  readonly displayName: string;
  readonly page: Page;
  readonly limbs: LimbControls;
  readonly avatarSlots: AvatarSlots;
  readonly soundController: SoundController;
  readonly library: LibraryController;
  readonly stageHost: StageHost;
  readonly playback: PlaybackController;
  readonly exporter: Exporter;
  readonly theme: ThemeChoice;
  setMapping(mapping: Mapping): void;
}

/** Return the actions of the page's buttons, menus and panels, as far as the role of this page allows them. */
export function createUserActions(app: AppParts): UserActions {
  const props = pageAccess.allows("control") ? createPropActions(() => propContext(app)) : null;
  return {
    share: () => void copyShareLink(app.playback.current?.id ?? null, app.page.toast),
    language: () => {
      if (app.playback.current) savePosition(app.playback.current);
      history.replaceState(history.state, "", switchLanguage(location.href));
      location.reload();
    },
    theme: () => app.theme.toggle(),
    play: () => app.playback.togglePlaying(),
    loop: () => app.playback.toggleLoop(),
    seek: (seconds) => app.playback.current?.seek(seconds, performance.now()),
    camera: () => app.stageHost.toggleCamera(),
    sound: () => app.soundController.toggle(),
    volume: (volume) => (app.soundController.volume = volume),
    files: (files) => void openFiles(app, files, props),
    avatar: (file) => void app.avatarSlots.selected.load(file),
    danceAs: (avatar) => app.avatarSlots.selected.setActive(avatar),
    removeAvatar: () => void app.avatarSlots.selected.remove(),
    choose: (id) => void app.playback.playMotion(id),
    picture: () => savePicture(app),
    download: (...request) => void app.exporter.downloadMotion(...request),
    remove: (motion) => {
      if (!confirm(translate('Remove "{name}" from the library?', { name: motion.name }))) return;
      app.library.remove(motion.id).catch((error: unknown) => showProblem(app.page.library, motion.name, error));
    },
    search: (query) =>
      app.library.search(query).catch((error: unknown) => showProblem(app.page.library, translate("Library"), error)),
    toggle: (limb) => app.limbs.act("toggle", limb),
    ask: (limb) => app.limbs.act("ask", limb),
    withdraw: (limb) => app.limbs.act("withdraw", limb),
    give: (limb) => app.limbs.act("give", limb),
    join: () => app.limbs.act("join"),
    select: (limb) => app.limbs.act("hold", limb),
    press: (input, down) => {
      const { commands } = app.limbs;
      if (down) commands.press(`page ${input}`, [input], 1, performance.now());
      else commands.release(`page ${input}`, performance.now());
    },
    useCamera: (onChange) =>
      import("./webcam-controller").then(({ toggleWebcam }) => toggleWebcam(webcamStage(app), onChange)),
    mapping: (mapping) => app.setMapping(mapping),
    focus: (limb) => app.limbs.focus(limb),
    dancer: (performer) => app.limbs.selectPerformer(performer),
    nextDancer: () => app.limbs.selectPerformer("next"),
    reframe: () => app.stageHost.resize(),
    labels: (metrics) => app.stageHost.setLabels(metrics),
    mappingShown: () => app.stageHost.pollGamepad(),
    ...(pageAccess.allows("control")
      ? {
          crowd: createCrowdActions(app),
        }
      : {}),
    ...(pageAccess.allows("ingest")
      ? {
          keep: createPageRecordAction(app),
          captureTarget: () => captureTarget(app.playback.current),
          edits: createEditActions(app),
        }
      : {}),
    ...(props ? { props } : {}),
    ...(pageAccess.allows("ingest") && pageAccess.allows("control")
      ? {
          add: (motion) => {
            const { current } = app.playback;
            if (!current) return;
            void addMotionToStage(motion, current, app.library.motions, app.page.library).then(() =>
              app.library.render(),
            );
          },
        }
      : {}),
  };
}

/** Return the actions of keys, mouse buttons and gamepad, other than claiming and moving limbs. */
export function createKeyActions(app: AppParts): PageActions {
  return {
    next_dancer: () => app.limbs.selectPerformer("next"),
    ask: () => app.limbs.act("ask"),
    give: () => app.limbs.act("give"),
    join: () => app.limbs.act("join"),
    prop: () => {
      if (pageAccess.allows("control")) void moveNearestProp(propContext(app));
    },
    play: () => app.playback.togglePlaying(),
    back: () => app.playback.current?.seekByBlocks(-1, performance.now()),
    forward: () => app.playback.current?.seekByBlocks(1, performance.now()),
    camera: () => app.stageHost.toggleCamera(),
    sound: () => app.soundController.toggle(),
    keep: () => app.page.transport.record(),
    picture: () => savePicture(app),
    library: () => app.page.panels.toggle("library"),
    strings: () => app.page.panels.toggle("strings"),
    line: () => app.page.panels.toggle("line"),
  };
}

/** Return the actions of the controls that open limbs to the audience. */
function createCrowdActions(app: AppParts): CrowdActions {
  const session = () => app.playback.current?.id ?? null;
  return {
    openLimbs: (crowd) => {
      const id = session();
      if (id === null) return;
      editSession(id, { crowd }).catch((error: unknown) => {
        if (!(error instanceof ProblemError)) throw error;
        app.page.toast(translate("{title}: {detail}", error));
      });
    },
    share: () => void copyShareLink(session(), app.page.toast),
    shareLink: async () => (await createShareLink(session(), app.page.toast))?.href ?? null,
  };
}

/** Load the last avatar file of these, and upload all files of motions and props if this page may. */
async function openFiles(app: AppParts, files: readonly File[], props: PropActions | null): Promise<void> {
  const { page, avatarSlots } = app;
  const kinds = await Promise.all(files.map(findFileKind));
  const avatar = files.findLast((_, index) => kinds[index] === "avatar");
  if (avatar) void avatarSlots.selected.load(avatar);
  const uploadable = (kind: FileKind) =>
    pageAccess.allows("ingest") ? files.filter((_, index) => kinds[index] === kind) : [];
  const models = uploadable("prop");
  if (props && models.length > 0) void bringProps(app, models, props);
  const motions = uploadable("motion");
  if (avatar || motions.length > 0) page.panels.open("library");
  if (motions.length === 0) return;
  try {
    const { uploadFiles } = await import("./upload-controller");
    uploadFiles(uploadTarget(app), motions);
  } catch {
    showProblem(page.library, motions[0].name, ProblemError.unreachable());
  }
}

/** Store files as props, and bring them on the stage of the session. */
async function bringProps({ page, playback }: AppParts, files: readonly File[], props: PropActions): Promise<void> {
  if (playback.current?.kind !== "sessions") {
    page.toast(translate("Props need a session: choose a dance from the library first"));
    return;
  }
  try {
    await (await props.stored()).upload(files);
  } catch {
    page.toast(translate("{title}: {detail}", ProblemError.unreachable()));
  }
}

function uploadTarget({ page, library, playback }: AppParts): UploadTarget {
  return {
    library: page.library,
    toast: page.toast,
    refresh: () => library.refresh().catch(() => undefined),
    refreshLater: () => library.refreshRepeatedly(),
    play: (id, keepsLibrary) => playback.playUploadedMotion(id, keepsLibrary),
  };
}

/** Return the actions of the editor of a motion. */
function createEditActions(app: AppParts): EditActions {
  return {
    label: (motion, labels) =>
      app.library.label(motion.id, labels).then(
        () => true,
        (error: unknown) => {
          showProblem(app.page.library, motion.name, error);
          return false;
        },
      ),
    edit: (motion, edit) =>
      createEditedMotion(motion, edit, app.page.library, (made) => app.playback.playUploadedMotion(made.id)),
    position: ({ id }) => (app.library.currentItem?.id === id ? (app.playback.current?.position ?? null) : null),
  };
}

function propContext({ page, playback, stageHost }: AppParts): PropContext {
  const { current } = playback;
  return {
    toast: page.toast,
    current: current?.kind === "sessions" ? current : null,
    putProp: (prop, limb) => stageHost.putProp(prop, limb),
    moveProp: () => stageHost.moveProp(),
  };
}

function webcamStage(app: AppParts): WebcamStage {
  const { playback, limbs, displayName, page, library } = app;
  const { current } = playback;
  return {
    moveBody: (hands, now) => limbs.moveBody(hands, now),
    session: current?.kind === "sessions" && pageAccess.allows("ingest") ? current.id : null,
    displayName,
    toast: page.toast,
    onPerformed: (id) =>
      void library.waitFor(id).then((motion) => {
        if (motion) showKept(motion, keptMotionActions(app));
      }),
  };
}

function keptMotionActions(app: AppParts): KeptMotionActions {
  return {
    toast: (message, ...actions) => app.page.toast(message, ...actions),
    play: (motion) => void app.playback.playMotion(motion),
    showDownloads: (motion) => {
      app.page.panels.open("library");
      app.page.library.showDownloads(motion);
    },
  };
}

function captureTarget(playback: RemotePlayback | null): CaptureTarget {
  return { session: playback?.kind === "sessions" ? playback.id : null, needsToken: pageAccess.hasToken };
}

function savePicture({ exporter, library }: AppParts): void {
  void exporter.savePicture(library.currentItem?.name ?? "");
}

function createPageRecordAction(app: AppParts): () => Promise<void> {
  return createRecordAction({
    record: (session, name) =>
      app.stageHost.cameraKeyframes().then((camera) => recordSession(session, { name, camera })),
    ...keptMotionActions(app),
    session: () => {
      const { current } = app.playback;
      return current && { id: current.id, motionName: app.library.currentItem?.name ?? "" };
    },
    puppeteer: app.displayName,
    onRecorded: () => app.library.refresh(),
  });
}
