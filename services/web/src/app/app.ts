/** Composition of the page around the stage: session, inputs, sound and user interface. */
import { browserSoundPreference } from "../audio/preference";
import { pageAccess } from "../client/access";
import type { EngineCommand } from "../engine/message";
import { translate } from "../i18n/translator";
import type { Mapping } from "../input/mapping";
import { loadMapping, saveMapping } from "../input/mapping-store";
import { FileStore } from "../storage/file-store";
import { browserStorage } from "../storage/web-storage";
import { createPage, type Page } from "../ui/page";
import { createTheme, type ThemeChoice } from "../ui/theme";
import { AvatarSlots } from "./avatar-slot";
import type { EarlyStage } from "./early-stage";
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

  /** `isAlone` is true if the stage is shown without controls. */
  constructor(
    canvas: HTMLCanvasElement,
    startup: StartupSequence,
    private readonly early: EarlyStage,
    isAlone: boolean,
  ) {
    const { engine, reducedMotion } = early;
    canvas.ariaLabel = translate(
      "A wooden puppet dancing before a disc of gold leaf. Take its hands and legs by button or by the keys 1 to 4.",
    );
    this.displayName = early.displayName;
    this.page = createPage(document.body, createUserActions(this));
    const { page } = this;
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
      isAlone,
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
      early,
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

  /** Take over the stage. */
  start(): void {
    this.page.mappingDialog.setMapping(this.#mapping);
    this.page.transport.setHealth("none");
    void this.playback.start();
    this.stageHost.open();
    this.early.listen((event) => this.stageHost.onEvent(event));
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
