/** What the view works on: the document with its history, the pictures, the engine's answers, and what went wrong. */
import type { ReactiveControllerHost } from 'lit';
import { Session, SLOW } from '../components/session.js';
import type { NamedFile } from '../datasets/gather.js';
import { LastRequest } from '../engine/last-request.js';
import { EngineProblem, WorkerDied } from '../engine/remote.js';
import { messageOf } from '../engine/message-of.js';
import { BevClient } from './client.js';
import { type BevDocument, begun, changed, continued, type History, newDocument, queryOf } from './document.js';
import { redone, resized, undone } from './document.js';
import { decodePicture, fetchBlob, fetchSampleFile, hasSample, type Picture, pixelsOf, roleOfName } from './images.js';
import { ownerOf } from '../views/settings-link.js';
import { readFragment } from './link.js';
import type { About, Projection, BevPoint, BevPreset, BevRole, BevScene, Pixel, Strip } from './protocol.js';

export interface Problem {
  text: string;
  /** What can be done about it with one click. */
  remedy?: { label: string; act: () => void };
}

/** What the session reports to its view. */
export interface Listener {
  strip(strip: Strip): void;
  /** The warped picture no longer holds. */
  unwarped(): void;
  /** An answer is to be drawn; `since` is when its question came up. */
  answered(since: number): void;
}

/** What a file is, by its name; any other one is a picture. */
const TABLE = /\.(csv|txt|tsv)$/i;
const SCENE = /\.json$/i;

export class BevSession extends Session<BevClient> {
  /** The latest answer, with the document that it belongs to. */
  answered: { document: BevDocument; answer: Projection } | null = null;
  problems: ReadonlyMap<string, Problem> = new Map();
  presets: readonly BevPreset[] = [];
  /** How much of the warped top view covers the front view, 0 to 1. */
  blend = 0;
  version = '';
  private history: History | null = null;
  private pictures: Record<BevRole, (Picture & { isSample: boolean }) | null> = { top: null, front: null };
  /** Number of openings: a scene that the page opens itself is dropped if another one is opened while it loads. */
  private readonly opening = new LastRequest();

  #beginWith: [src: string, withSample: boolean] = ['', true];
  readonly #listener: Listener;
  readonly #retry = { label: 'Try again', act: (): void => this.restart() };

  constructor(host: ReactiveControllerHost & EventTarget, listener: Listener) {
    super(host);
    this.#listener = listener;
  }

  protected override createClient(): BevClient {
    return new BevClient({
      strip: (strip) => this.#listener.strip(strip),
      crashed: (message) => this.onCrash(message),
      slow: (isSlow) => {
        if (isSlow) this.setProblem('slow', SLOW, this.#retry);
        else this.settle('slow');
      },
      unavailable: (message) => {
        this.settle('slow');
        this.setProblem('crash', `${message}. If trying again does not help, reload the page.`, this.#retry);
      },
    });
  }

  /** Begins with what the page's address holds, the scene at `src`, the sample, or a preset. */
  async begin(src: string, withSample: boolean): Promise<void> {
    this.#beginWith = [src, withSample];
    const { client } = this;
    if (!client) return;
    let about: About;
    try {
      about = await client.start();
    } catch {
      return; // reported as `unavailable`
    }
    const { version, presets } = about;
    this.version = version;
    this.presets = presets;
    const [first] = presets;
    if (this.history) {
      this.take(this.history); // the element was moved: its new engine knows nothing yet
      return this.keepTop();
    }
    if (first) this.take(begun(newDocument(first.scene)));
    if (ownerOf(location.hash) === 'bev' && (await this.openLink())) return;
    if (src !== '') await this.attempt('file', () => this.openAddress(src));
    else if (hasSample && withSample) await this.openSample();
  }

  override restart(): void {
    this.settle('crash');
    this.settle('slow');
    super.restart();
    void this.begin(...this.#beginWith);
  }

  /** Sends the data of a crashed worker to its replacement. */
  private onCrash(message: string): void {
    this.setProblem('crash', `The engine crashed: ${message}. It was started anew; please report this.`);
    void this.attempt('crash of the picture', () => this.keepTop());
    if (this.history) this.ask(this.history.present);
  }

  // The document.

  get document(): BevDocument | null {
    return this.history?.present ?? null;
  }

  /** Whether the pictures are the sample's. */
  get isSample(): boolean {
    const { top, front } = this.pictures;
    return top?.isSample === true && front?.isSample === true;
  }

  get canUndo(): boolean {
    return (this.history?.past.length ?? 0) > 0;
  }

  get canRedo(): boolean {
    return (this.history?.future.length ?? 0) > 0;
  }

  /** A single change, or the next step of a drag. */
  change(change: Partial<BevDocument>, isStep = false): void {
    const { history } = this;
    if (!history) return;
    const next = { ...history.present, ...change };
    if (!isStep) this.take(changed(history, next));
    else this.take(continued(history, next), false);
  }

  setScene(scene: BevScene): void {
    this.change({ scene });
  }

  undo(): void {
    if (this.history) this.take(undone(this.history));
  }

  redo(): void {
    if (this.history) this.take(redone(this.history));
  }

  /** Steps of a drag are drawn once, with their answer. */
  private take(history: History, isShownAtOnce = true): void {
    const before = this.history?.present;
    this.history = history;
    const { present } = history;
    if (isShownAtOnce) this.changed();
    this.ask(present);
    if (before?.scene === present.scene) return;
    void this.checkSizes(present.scene);
    this.warp();
  }

  private ask(document: BevDocument): void {
    const since = performance.now();
    this.client?.project(queryOf(document), (answer) => {
      if (answer instanceof EngineProblem) {
        this.setProblem('scene', answer.message);
        return;
      }
      this.settle('scene');
      const { answered } = this;
      // What follows from the scene alone stays the same object, so that nobody draws it again.
      const same = answered?.document.scene === document.scene ? answered.answer : answer;
      const { layout, homography, common } = same;
      this.answered = { document, answer: { ...answer, layout, homography, common } };
      this.changed();
      this.#listener.answered(since);
    });
  }

  /** Warps the top view over the front view again. */
  private warp(): void {
    const { document } = this;
    if (document && this.bitmapOf('top')) {
      this.client?.warp(document.scene);
    } else {
      this.client?.unwarp();
      this.#listener.unwarped();
    }
  }

  /** A pixel followed to the other view; null where the scene is none, which is reported already. */
  async follow(from: BevRole, pixel: Pixel): Promise<BevPoint | null> {
    const { document, client } = this;
    if (!document || !client) return null;
    try {
      return await client.call('follow', { scene: document.scene, from, pixel });
    } catch (error) {
      if (error instanceof EngineProblem || error instanceof WorkerDied) return null;
      throw error;
    }
  }

  // Pictures and files.

  pictureOf(role: BevRole): Picture | null {
    return this.pictures[role];
  }

  /** The picture of a view, where it has the size that its camera is said to have. */
  bitmapOf(role: BevRole): ImageBitmap | null {
    const bitmap = this.pictures[role]?.bitmap ?? null;
    const camera = this.document?.scene[role];
    return bitmap && camera && bitmap.width === camera.width && bitmap.height === camera.height ? bitmap : null;
  }

  /** Files of any kind: scenes, points, pictures; a single picture is of the view `role`. */
  async open(files: readonly NamedFile[], role: BevRole | null = null): Promise<void> {
    this.opening.end();
    for (const { name, file } of files) {
      if (SCENE.test(name)) await this.attempt('file', async () => this.replaceScene(await this.readScene(name, file)));
      else if (TABLE.test(name)) await this.attempt('file', () => this.openPoints(name, file));
    }
    const pictures = files.filter(({ name }) => !SCENE.test(name) && !TABLE.test(name));
    const roles = pictures.map(({ name }) => (pictures.length === 1 ? role : null) ?? roleOfName(name));
    for (const [index, { name, file }] of pictures.entries()) {
      const free = (['top', 'front'] as const).filter((one) => !roles.includes(one));
      const chosen = roles[index] ?? free.find((one) => !this.pictures[one]) ?? free[0] ?? 'top';
      roles[index] = chosen;
      await this.openPicture(chosen, name, file);
    }
  }

  openPreset({ scene }: BevPreset): void {
    this.opening.end();
    this.replaceScene(scene);
  }

  async openSample(): Promise<void> {
    await this.attempt('file', async () => {
      const signal = this.opening.begin();
      const scene = await this.readScene('scene.json', await fetchSampleFile('scene.json'));
      if (signal.aborted) return;
      this.setScene(scene);
      await this.openSamplePictures(signal);
    });
  }

  /** Opens the scene in the page's address, or reports why it cannot; false where there is none. */
  async openLink(): Promise<boolean> {
    try {
      const linked = readFragment(location.hash);
      if (!linked) return false;
      const signal = this.opening.begin();
      // Somebody may have changed it: the engine says whether it is a scene.
      const scene = await this.readScene('The link', new Blob([JSON.stringify(linked.document.scene)]));
      if (signal.aborted) return true;
      const document = { ...linked.document, scene };
      if (!linked.isSample) this.forgetSample();
      this.take(this.history ? changed(this.history, document) : begun(document));
      this.blend = linked.blend;
      if (linked.isSample && hasSample) void this.attempt('file', () => this.openSamplePictures(signal));
      return true;
    } catch (error) {
      this.setProblem('file', messageOf(error));
      return true;
    }
  }

  private async readScene(name: string, blob: Blob): Promise<BevScene> {
    const bytes = new Uint8Array(await blob.arrayBuffer());
    const { client } = this;
    if (!client) throw new Error('The view was closed.');
    return client.call('readScene', { name, bytes });
  }

  /** Another scene, which the sample's pictures do not show. */
  private replaceScene(scene: BevScene): void {
    this.forgetSample();
    this.setScene(scene);
  }

  private forgetSample(): void {
    const { top, front } = this.pictures;
    this.pictures = { top: top?.isSample ? null : top, front: front?.isSample ? null : front };
    for (const role of ['top', 'front'] as const) {
      if (!this.pictures[role]) this.settle(`size of ${role}`);
    }
  }

  private async openPoints(name: string, blob: Blob): Promise<void> {
    const bytes = new Uint8Array(await blob.arrayBuffer());
    const marked = (await this.client?.call('readPoints', { name, bytes })) ?? new Float64Array();
    const points = Array.from({ length: marked.length / 2 }, (_, i): Pixel => [
      marked[2 * i] as number,
      marked[2 * i + 1] as number,
    ]);
    this.change({ points, tool: this.document?.tool === 'points' ? 'points' : 'polygon' });
  }

  async openAddress(address: string): Promise<void> {
    const signal = this.opening.begin();
    const url = new URL(address, window.document.baseURI);
    const scene = await this.readScene(address, await fetchBlob(url.href));
    if (signal.aborted) return;
    this.setScene(scene);
    for (const role of ['top', 'front'] as const) {
      const { image } = scene[role];
      if (image) await this.openPicture(role, image, await fetchBlob(new URL(image, url).href), signal);
    }
  }

  private async openSamplePictures(signal: AbortSignal): Promise<void> {
    for (const role of ['top', 'front'] as const) {
      await this.openPicture(role, `${role}.jpg`, await fetchSampleFile(`${role}.jpg`), signal, true);
    }
  }

  /** Shows a picture; what is none leaves the last one. */
  private async openPicture(
    role: BevRole,
    name: string,
    blob: Blob,
    signal: AbortSignal | null = null,
    isSample = false,
  ): Promise<void> {
    await this.attempt(`picture of ${role}`, async () => {
      const picture = { ...(await decodePicture(name, blob)), isSample };
      if (signal?.aborted) return;
      this.pictures = { ...this.pictures, [role]: picture };
      this.changed();
      if (this.document) await this.checkSizes(this.document.scene);
      if (role === 'top') await this.keepTop();
    });
  }

  /** Hands the top view to the engine, which warps it. */
  private async keepTop(): Promise<void> {
    const { top } = this.pictures;
    if (!top) return;
    const rgba = pixelsOf(top);
    await this.client?.keepImage(rgba);
    this.warp();
  }

  private async checkSizes(scene: BevScene): Promise<void> {
    for (const role of ['top', 'front'] as const) {
      const bitmap = this.pictures[role]?.bitmap;
      if (bitmap) await this.checkSize(scene, role, bitmap);
    }
  }

  private async checkSize(scene: BevScene, role: BevRole, { width, height }: ImageBitmap): Promise<void> {
    try {
      await this.client?.call('checkImage', { scene, role, width, height });
      this.settle(`size of ${role}`);
    } catch (error) {
      if (error instanceof WorkerDied) return; // reported already
      if (!(error instanceof EngineProblem)) throw error;
      const act = () => this.useSize(role, width, height);
      this.setProblem(`size of ${role}`, error.message, { label: `Use ${width} × ${height}`, act });
    }
  }

  /** Gives a camera the size of its picture. */
  private useSize(role: BevRole, width: number, height: number): void {
    const { document } = this;
    if (!document) return;
    this.setScene({ ...document.scene, [role]: resized(document.scene[role], width, height) });
  }

  // Problems.

  setProblem(key: string, text: string, remedy?: Problem['remedy']): void {
    this.raise({ file: '', place: '', text, remedy: '' });
    this.problems = new Map(this.problems).set(key, remedy ? { text, remedy } : { text });
    this.changed();
  }

  settle(key: string): void {
    if (!this.problems.has(key)) return;
    const rest = new Map(this.problems);
    rest.delete(key);
    this.problems = rest;
    this.changed();
  }

  /** Does something with what the user gave; what is wrong with it is reported, and all else stays as it was. */
  async attempt(key: string, action: () => Promise<unknown>): Promise<void> {
    try {
      this.settle(key);
      await action();
    } catch (error) {
      this.setProblem(key, messageOf(error));
    }
  }
}
