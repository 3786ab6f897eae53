/** The growing map of clouds or depth images: each is registered as it comes, as long as the one before has been. */
import { cameraFileOf, frameOf, kindOf, type Message } from '../../../package/live/frames.js';
import { fileInMemory } from '../../../package/files/content.js';
import { SpatialClient, type SpatialInputs } from '../engine/spatial-client.js';
import type { SpatialJob } from '../engine/preparer.js';
import type { Growth, GrowthHooks, SpatialShown } from './growth.js';

/** Frames that wait for their registration at most: while one is registered, the next is prepared. */
const MOST_WAITING = 2;

export class SpatialGrowth implements Growth {
  shown: SpatialShown | null = null;
  numPlaced = 0;
  numDropped = 0;
  #hooks;
  /** The camera of depth images; null before it is known. */
  #camera: () => Message | null;
  #client: SpatialClient;
  #jobs: SpatialJob[] = [];
  /** Of frames that are not registered yet. */
  #files: Map<number, Uint8Array> = new Map();
  #intrinsics: SpatialInputs['intrinsics'] = null;

  constructor(hooks: GrowthHooks, camera: () => Message | null) {
    this.#hooks = hooks;
    this.#camera = camera;
    this.#client = this.#begun();
  }

  take(message: Message): void {
    const isCloud = kindOf(message.topic) !== 'image';
    if (this.#files.size >= MOST_WAITING || !(isCloud || this.#hasCamera(message))) {
      this.numDropped++;
      return;
    }
    const index = this.#jobs.length;
    try {
      const { time, file } = frameOf(message);
      this.#files.set(index, file);
      const path = `${message.topic.name} ${index + 1}`;
      // Read twice where it is the first one, and again should its thread die.
      const read = async (): Promise<Uint8Array> => this.#files.get(index)?.slice() ?? new Uint8Array();
      this.#jobs.push({ index, name: path, time, file: { path, read }, color: null, isCloud });
    } catch (error) {
      this.numDropped++;
      throw error;
    }
    const jobs = [...this.#jobs];
    const inputs = { jobs, num_recorded: 0, intrinsics: this.#intrinsics, reference: null, isGrowing: true };
    if (index === 0) this.#client.load(inputs, {});
    else this.#client.extend(inputs);
  }

  dispose(): void {
    this.#client.dispose();
  }

  #begun(): SpatialClient {
    this.#jobs = [];
    this.#files.clear();
    return new SpatialClient({
      ready: () => undefined,
      registered: (index) => {
        this.#files.delete(index);
        this.numPlaced++;
      },
      finishing: () => undefined,
      snapshot: (_, snapshot) => {
        this.shown = { kind: 'spatial', snapshot };
        this.#hooks.changed();
      },
      problem: ({ file, problem }) => {
        const index = this.#jobs.findLastIndex(({ name }) => name === file);
        if (this.#files.delete(index)) this.numDropped++;
        this.#hooks.problem(problem);
      },
      replaced: () => undefined,
      crashed: (message) => {
        this.#hooks.problem(`the engine of the growing map crashed (${message}), and the map begins anew`);
        this.#client.dispose();
        this.#client = this.#begun();
      },
      unavailable: (message) => this.#hooks.problem(message.replace(/\.$/, '')),
    });
  }

  /** Whether the camera of these depth images is known. */
  #hasCamera({ topic }: Message): boolean {
    const camera = this.#intrinsics ? null : this.#camera();
    const file = camera && cameraFileOf(camera, topic);
    if (file) this.#intrinsics = fileInMemory('camera.json', file);
    return this.#intrinsics !== null;
  }
}
