/** Composition of the page: session, stage, inputs, sound and user interface. */
import { browserSoundPreference } from "../audio/preference";
import { pageAccess } from "../client/access";
import { translate } from "../i18n/translator";
import type { Mapping } from "../input/mapping";
import { loadMapping, saveMapping } from "../input/mapping-store";
import { FileStore } from "../storage/file-store";
import { browserStorage } from "../storage/web-storage";
import { resolveDisplayName } from "../ui/display-name";
import { createPage, type Page } from "../ui/page";
import { createTheme, type ThemeChoice } from "../ui/theme";
import { AvatarSlots } from "./avatar-slot";
import { ClaimController } from "./claim-controller";
import { Exporter } from "./exporter";
import { Invitation } from "./invitation";
import { LibraryController } from "./library-controller";
import { PlaybackController } from "./playback-controller";
import { SoundController } from "./sound-controller";
import { StageHost } from "./stage-host";
import type { StartupSequence } from "./startup";
import { type AppParts, createKeyActions, createUserActions } from "./user-actions";

export class App implements AppParts {
  readonly displayName: string;
  readonly page: Page;
  readonly limbController: ClaimController;
  readonly avatarSlots: AvatarSlots;
  readonly soundController: SoundController;
  readonly library: LibraryController;
  readonly stageHost: StageHost;
  readonly playback: PlaybackController;
  readonly exporter: Exporter;
  readonly theme: ThemeChoice;
  #mapping: Mapping = loadMapping();

  constructor(canvas: HTMLCanvasElement, query: URLSearchParams, startup: StartupSequence) {
    const reducedMotion = matchMedia("(prefers-reduced-motion: reduce)");
    canvas.ariaLabel = translate(
      "A wooden puppet dancing before a disc of gold leaf. Take its hands and legs by button or by the keys 1 to 4.",
    );
    this.displayName = resolveDisplayName(query, Math.random());
    this.page = createPage(document.body, createUserActions(this));
    const { page } = this;
    const getPlayback = () => this.playback.current;
    this.exporter = new Exporter(page, () => ({ playback: getPlayback(), stage: this.stageHost.stage }));
    this.limbController = new ClaimController(page, () => this.#mapping);
    this.limbController.viewOnly = !pageAccess.allows("control");
    this.avatarSlots = new AvatarSlots(
      { page, files: new FileStore("bunraku"), preferences: browserStorage },
      this.limbController.selectedPerformer,
    );
    this.library = new LibraryController(page, getPlayback);
    this.soundController = new SoundController(
      (state) => page.transport.sound.render(state),
      page.transport.sound.element,
      browserSoundPreference,
    );
    this.stageHost = new StageHost({
      canvas,
      page,
      startup,
      reducedMotion,
      bestQuality: query.get("quality") === "best",
      limbController: this.limbController,
      avatarSlots: this.avatarSlots,
      invitation: new Invitation(page.nameTags),
      actions: createKeyActions(this),
      getMapping: () => this.#mapping,
      getTheme: () => this.theme.theme,
      getPlayback,
      onOpen: () => this.#exposeDebugHandle(),
    });
    this.playback = new PlaybackController({
      page,
      startup,
      reducedMotion,
      query,
      displayName: this.displayName,
      library: this.library,
      limbController: this.limbController,
      soundController: this.soundController,
      avatarSlots: this.avatarSlots,
      stageHost: this.stageHost,
      onOpen: () => this.#exposeDebugHandle(),
    });
    this.theme = createTheme((theme) => {
      page.header.setTheme(theme);
      this.stageHost.stage?.setTheme(theme);
    });
  }

  /** Enter the session and load the stage, both at the same time. */
  start(): void {
    this.page.mappingDialog.setMapping(this.#mapping);
    this.limbController.render();
    this.page.transport.setHealth("none");
    void this.playback.start();
    void this.stageHost.open();
    this.avatarSlots.restore(1);
  }

  /** Apply an edited key and gamepad mapping, and store it in the browser. */
  setMapping(mapping: Mapping): void {
    this.#mapping = mapping;
    saveMapping(mapping);
    this.page.mappingDialog.setMapping(mapping);
    this.limbController.render();
  }

  /** Set `window.bunraku`, the parts of the running page, for tests and for developers. */
  #exposeDebugHandle(): void {
    const { current } = this.playback;
    const { stage, controller } = this.stageHost;
    Object.assign(window, {
      bunraku: {
        stage,
        viewer: current?.viewer ?? null,
        puppeteer: current?.puppeteer ?? null,
        hands: controller?.hands ?? null,
        listening: this.soundController,
      },
    });
  }
}
