/** How the lab's clouds are opened: files, scenes of the gallery, links, addresses of the host page; the last request wins. */
import type { GivenClouds } from '../run/given-clouds.js';
import { filesOfDrop, type NamedFile } from '../datasets/gather.js';
import type { Note } from '../datasets/note.js';
import { LastRequest } from '../engine/last-request.js';
import { messageOf } from '../engine/message-of.js';
import { baseName } from '../views/format.js';
import {
  addressedClouds,
  asLinked,
  isCloudName,
  isMapName,
  joined,
  type OpenedScene,
  SAMPLE,
  sampleClouds,
  SCENE_ITEMS,
  sceneClouds,
} from './clouds.js';
import { type Tab, TABS } from './lab-side.js';
import { type LabLink, readLink, writeLink } from './link.js';
import { takeOwn } from './own-files.js';
import type { LabSession } from './session.js';

export class LabOpening {
  readonly #session: LabSession;
  readonly #chooseTab: (tab: Tab) => void;
  /** The scene of the gallery that was opened last. */
  #scene: OpenedScene | null = null;
  /** What a link says of files that are not there yet. */
  #awaited: LabLink | null = null;
  readonly #fetching = new LastRequest();

  constructor(session: LabSession, chooseTab: (tab: Tab) => void) {
    this.#session = session;
    this.#chooseTab = chooseTab;
  }

  /** The scene of the gallery that the clouds are of. */
  get scene(): OpenedScene | null {
    return this.#scene?.given.of === this.#session.given?.of ? this.#scene : null;
  }

  openSample(): void {
    this.#attend(sampleClouds());
  }

  /** Opens what the host page names: two clouds, or a scene. */
  openOwn(src: string, example: string): void {
    if (src) this.#attend(addressedClouds(src));
    else if (sceneClouds(example)) this.showExample(example);
    else if (example) {
      const names = SCENE_ITEMS.map(({ id }) => id).join(', ');
      this.#session.report(`There is no scene “${example}”`, `Name one of these: ${names}`);
    }
  }

  /** Opens what the page's address names, if it names anything. */
  openAddress(hash: string): boolean {
    const link = readLink(hash);
    if (!link?.source && !link?.sample) return false;
    this.#openLink(link);
    return true;
  }

  #openLink(link: LabLink): void {
    const { sample, source, target, tab } = link;
    this.#chooseTab(TABS.find((one) => one.tab === tab)?.tab ?? 'step');
    const scene = sample === null ? null : sceneClouds(sample);
    if (scene) {
      void this.#openScene(scene, link);
      return;
    }
    if (sample !== SAMPLE) {
      this.#awaited = link;
      const names = [source, target].map(baseName).join(' and ');
      this.#session.report(
        `This link is about ${names}, which it cannot carry`,
        isMapName(target)
          ? 'Open the recording on the map, and look inside this scan or frame'
          : 'Drop these two files here',
      );
      return;
    }
    this.#attend(sampleClouds(source, target), (given) => this.#openAs(given, link));
  }

  showExample(name: string): void {
    const scene = sceneClouds(name);
    if (scene) void this.#openScene(scene);
  }

  link(tab: Tab): string {
    const { given, run, runs, start, at, facts } = this.#session;
    if (!given || !run) return '';
    const { source, target, sample } = given;
    const others = runs.filter((other) => other !== run && !other.own).map(({ options }) => options);
    const content = { sample: sample || null, source, target, options: run.options, others, start, at, tab };
    return writeLink(content, facts?.is_planar ?? true, this.scene?.first ?? {});
  }

  async take(files: readonly NamedFile[]): Promise<void> {
    const clouds = files.filter(({ name }) => isCloudName(name));
    const [other] = files.filter(({ name }) => !isCloudName(name));
    if (other && clouds.length === 0) {
      if (await takeOwn(this.#session, other)) this.#chooseTab('method');
      return;
    }
    const given = joined(this.#session.given, clouds);
    const link = this.#awaited && given && asLinked(given, this.#awaited);
    if (link) {
      this.#awaited = null;
      await this.#openAs(link.given, link);
    } else if (given?.target) await this.#session.open(given);
    else this.#session.report('One cloud alone is registered to nothing', 'Drop two clouds together');
  }

  async takeDrop(transfer: DataTransfer): Promise<void> {
    const unreadable: Note[] = [];
    await this.take(await filesOfDrop(transfer, unreadable));
    for (const { file, reason } of unreadable) this.#session.report(`${file}: ${reason}`);
  }

  /** A scene of the gallery, with the methods that it compares; a link may hold other methods, a start and an iteration. */
  async #openScene(scene: OpenedScene, link: LabLink | null = null): Promise<void> {
    const options = { ...scene.first, ...link?.options };
    const others = link && link.others.length > 0 ? link.others : scene.others;
    this.#scene = scene;
    await this.#openAs(scene.given, { options, others, start: link?.start ?? null, at: link?.at ?? 0 });
  }

  async #openAs(
    given: GivenClouds,
    { options, others, start, at }: Pick<LabLink, 'options' | 'others' | 'start' | 'at'>,
  ): Promise<void> {
    const session = this.#session;
    await session.open(given, options, start);
    const first = session.active;
    for (const other of others) await session.addRun(other);
    session.selectRun(first);
    session.player.seek(at);
  }

  /** Opens clouds that are being fetched, unless others are opened or asked for meanwhile. */
  #attend(
    fetching: Promise<GivenClouds>,
    open: (given: GivenClouds) => Promise<void> = (given) => this.#session.open(given),
  ): void {
    const signal = this.#fetching.begin();
    const before = this.#session.given;
    const isWanted = (): boolean => !signal.aborted && this.#session.given === before;
    fetching.then(
      (given) => (isWanted() ? open(given) : undefined),
      (error: unknown) => {
        if (!isWanted()) return;
        this.#session.report(`The clouds could not be fetched: ${messageOf(error)}`, 'Reload the page');
      },
    );
  }
}
