/** The map of a stream as it grows: the newest frame is registered, those that come meanwhile are left out and counted. */
import type { SpatialReconstruction } from '../../pkg/scanstitch.js';
import { encapsulateRos1 } from '../bag/cdr.js';
import { cloudFile } from '../bag/clouds.js';
import { depthFile, usesOf } from '../bag/images.js';
import {
  decodeCamera,
  decodeCloud,
  decodeImage,
  decodeImageShape,
  decodeLivoxCloud,
  decodeStamp,
  TYPES,
} from '../bag/messages.js';
import { typeOf } from '../bag/open.js';
import { pinholeOf } from '../bag/recording.js';
import { lookUp } from '../base/look_up.js';
import { hintOf } from '../files/names.js';
import type { Offered } from '../live/source.js';
import { cameraFor, engineCamera } from '../recording/camera_file.js';
import type { Engine } from './command.js';

type Frame = { topic: Offered; bytes: Uint8Array };

export class LiveMap {
  numPlaced = 0;
  numDropped = 0;
  #engine;
  #reconstruction: SpatialReconstruction | null = null;
  /** What the map is made of. */
  #source: Offered | null = null;
  #camera: Frame | null = null;
  #waiting: Frame | null = null;
  #turn: ReturnType<typeof setImmediate> | undefined;

  constructor(engine: Engine) {
    this.#engine = engine;
  }

  take(topic: Offered, data: Uint8Array) {
    const kind = lookUp(TYPES, typeOf(topic.type));
    const bytes = topic.encoding === 'ros1' ? encapsulateRos1(data) : data;
    if (kind === 'camera') this.#camera ??= { topic, bytes };
    if (this.#source === null && isSource(kind, topic, bytes)) this.#source = topic;
    if (topic !== this.#source) return;
    if (this.#waiting) this.numDropped += 1;
    this.#waiting = { topic, bytes };
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

  #register({ topic, bytes }: Frame) {
    const { sec, nsec } = decodeStamp(bytes);
    const isImage = typeOf(topic.type) === 'sensor_msgs/msg/Image';
    const file = isImage ? depthFile(decodeImage(bytes)) : cloudFile(decodeOf(topic)(bytes));
    const [name, index, time] = [topic.name, this.numPlaced + this.numDropped, sec + nsec / 1e9];
    const known = this.#reconstruction;
    const reconstruction = known ?? new this.#engine.SpatialReconstruction();
    if (!known && isImage) this.#setCamera(reconstruction, topic);
    const config = reconstruction.begin(name, file);
    this.#reconstruction = reconstruction;
    const prepared = isImage
      ? this.#engine.prepare_frame(config, name, index, time, file, null, undefined, undefined)
      : this.#engine.prepare_cloud(config, name, index, time, file);
    reconstruction.add_prepared(prepared);
    while (reconstruction.step().stage !== 'done');
  }

  #setCamera(reconstruction: SpatialReconstruction, topic: Offered) {
    const camera = this.#camera && pinholeOf(decodeCamera(this.#camera.bytes), this.#camera.topic.name, topic.name);
    if (!camera) throw new RangeError('the camera is not known yet');
    const text = new TextEncoder().encode(JSON.stringify(camera));
    const { camera: read } = cameraFor('camera.json', text, camera);
    reconstruction.set_intrinsics('camera.json', engineCamera(read));
  }
}

function decodeOf({ type }: Offered) {
  return lookUp(TYPES, typeOf(type)) === 'livox cloud' ? decodeLivoxCloud : decodeCloud;
}

/** Whether a map can be made of these messages: clouds, or images that are depth by their names and encoding. */
function isSource(kind: string | undefined, { name }: Offered, bytes: Uint8Array) {
  if (kind === 'cloud' || kind === 'livox cloud') return true;
  return kind === 'image' && hintOf(name) === 'depth' && usesOf(decodeImageShape(bytes).encoding).includes('depth');
}
