/** The map of a stream as it grows: the newest frame is registered, those that come meanwhile are left out and counted. */
import type { SpatialReconstruction } from '../../pkg/scanstitch.js';
import { cameraFileOf, frameOf, kindOf, mapSourceOf, type Message, messageOf } from '../live/frames.js';
import type { Offered } from '../live/source.js';
import type { Engine } from './command.js';

export class LiveMap {
  numPlaced = 0;
  numDropped = 0;
  #engine;
  #reconstruction: SpatialReconstruction | null = null;
  /** What the map is made of. */
  #source: Offered | null = null;
  #camera: Message | null = null;
  #waiting: Message | null = null;
  #turn: ReturnType<typeof setImmediate> | undefined;

  constructor(engine: Engine) {
    this.#engine = engine;
  }

  take(topic: Offered, data: Uint8Array) {
    const message = messageOf(topic, data);
    if (kindOf(topic) === 'camera') this.#camera ??= message;
    if (this.#source === null && isInSpace(message)) this.#source = topic;
    if (topic !== this.#source) return;
    if (this.#waiting) this.numDropped += 1;
    this.#waiting = message;
    this.#turn ??= setImmediate(() => this.#place());
  }

  stop() {
    clearImmediate(this.#turn);
    if (this.#waiting) this.numDropped += 1;
    this.#waiting = null;
    this.#reconstruction?.free();
    this.#reconstruction = null;
  }

  #place() {
    const frame = this.#waiting;
    [this.#waiting, this.#turn] = [null, undefined];
    if (!frame) return;
    try {
      this.#register(frame);
      this.numPlaced += 1;
    } catch {
      // What is wrong with a message is told when the recording is read.
      this.numDropped += 1;
    }
  }

  #register(message: Message) {
    const { topic } = message;
    const isImage = kindOf(topic) === 'image';
    const { time, file } = frameOf(message);
    const [name, index] = [topic.name, this.numPlaced + this.numDropped];
    const reconstruction = (this.#reconstruction ??= this.#begun(topic, isImage));
    const config = reconstruction.begin(name, file);
    const prepared = isImage
      ? this.#engine.prepare_frame(config, name, index, time, file, null, undefined, undefined)
      : this.#engine.prepare_cloud(config, name, index, time, file);
    reconstruction.add_prepared(prepared);
    while (reconstruction.step().stage !== 'done');
  }

  #begun(topic: Offered, isImage: boolean) {
    const { SpatialReconstruction } = this.#engine;
    if (!isImage) return new SpatialReconstruction();
    const camera = this.#camera && cameraFileOf(this.#camera, topic);
    if (!camera) throw new RangeError('the camera is not known yet');
    const reconstruction = new SpatialReconstruction();
    reconstruction.set_intrinsics('camera.json', camera);
    return reconstruction;
  }
}

function isInSpace(message: Message) {
  const source = mapSourceOf(message);
  return source === 'depth' || source === 'clouds';
}
