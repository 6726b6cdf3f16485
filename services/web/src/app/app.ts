/** Composition of the page: session, stage, inputs, sound and user interface. */
import { browserSoundPreference } from "../audio/preference";
import { pageAccess } from "../client/access";
import type { EngineCommand, StageView } from "../engine/message";
import { pageLanguage, translate } from "../i18n/translator";
import type { Mapping } from "../input/mapping";
import { loadMapping, saveMapping } from "../input/mapping-store";
import { FileStore } from "../storage/file-store";
import { browserStorage } from "../storage/web-storage";
import { resolveDisplayName } from "../ui/display-name";
import { createPage, type Page } from "../ui/page";
import { createTheme, type ThemeChoice } from "../ui/theme";
import { AvatarSlots } from "./avatar-slot";
import { EngineConnection } from "./engine-connection";
import { Exporter } from "./exporter";
import { Invitation } from "./invitation";
import { LibraryController } from "./library-controller";
import { LimbControls } from "./limb-controls";
import { PlaybackController } from "./playback-controller";
import { SoundController } from "./sound-controller";
import { StageHost } from "./stage-host";
import type { StartupSequence } from "./startup";
import { type AppParts, createKeyActions, createUserActions } from "./user-actions";

export class App implements AppParts {
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
  #mapping: Mapping = loadMapping();

  /** `view` is the view without controls; null for the page with its controls. */
  constructor(canvas: HTMLCanvasElement, query: URLSearchParams, startup: StartupSequence, view: StageView | null) {
    const reducedMotion = matchMedia("(prefers-reduced-motion: reduce)");
    canvas.ariaLabel = translate(
      "A wooden puppet dancing before a disc of gold leaf. Take its hands and legs by button or by the keys 1 to 4.",
    );
    this.displayName = resolveDisplayName(query, Math.random());
    this.page = createPage(document.body, createUserActions(this));
    const { page } = this;
    const engine = new EngineConnection(
      canvas,
      {
        server: location.origin,
        token: pageAccess.token,
        language: pageLanguage(),
        timeOrigin: performance.timeOrigin,
        bestQuality: query.get("quality") === "best",
        view,
      },
      (event) => this.stageHost.onEvent(event),
    );
    const send = (command: EngineCommand) => engine.post(command);
    this.limbs = new LimbControls(send, createKeyActions(this));
    this.exporter = new Exporter(page, () => this.stageHost.takePicture());
    this.library = new LibraryController(page, () => this.playback.current);
    this.soundController = new SoundController(
      (state) => page.transport.sound.render(state),
      page.transport.sound.element,
      browserSoundPreference,
      () => page.toast(translate("This browser plays no sound here. Check its audio device.")),
    );
    this.stageHost = new StageHost({
      canvas,
      page,
      startup,
      reducedMotion,
      engine,
      limbs: this.limbs,
      getPlayback: () => this.playback,
      invitation: new Invitation(page.nameTags),
      getAvatarFiles: () => this.avatarSlots.activeFiles,
      viewOnly: !pageAccess.allows("control"),
      isAlone: view !== null,
      getMapping: () => this.#mapping,
    });
    this.avatarSlots = new AvatarSlots(
      { page, avatars: this.stageHost.avatars, files: new FileStore("bunraku"), preferences: browserStorage },
      this.limbs,
    );
    this.playback = new PlaybackController({
      page,
      startup,
      reducedMotion,
      query,
      displayName: this.displayName,
      library: this.library,
      soundController: this.soundController,
      avatarSlots: this.avatarSlots,
      send,
    });
    this.#exposeDebugHandle();
    this.theme = createTheme((theme) => {
      page.header.setTheme(theme);
      this.stageHost.setTheme(theme);
    });
  }

  /** Enter the session and start the engine, in `worker` if there is one, both at the same time. */
  start(worker: Promise<Worker | null>): void {
    this.page.mappingDialog.setMapping(this.#mapping);
    this.page.transport.setHealth("none");
    void this.playback.start();
    void this.stageHost.open(worker);
    this.avatarSlots.restore(1);
  }

  /** Apply an edited key and gamepad mapping, and store it in the browser. */
  setMapping(mapping: Mapping): void {
    this.#mapping = mapping;
    saveMapping(mapping);
    this.page.mappingDialog.setMapping(mapping);
    this.stageHost.setMapping(mapping);
  }

  /** Add the sound to `window.bunraku`, where tests and developers find the parts of the page. */
  #exposeDebugHandle(): void {
    const global = globalThis as { bunraku?: object };
    global.bunraku = { ...global.bunraku, listening: this.soundController };
  }
}
