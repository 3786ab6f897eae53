/** Messages of a stream as files that the engine reads, for a map that grows while they come. */
import { encapsulateRos1 } from '../bag/cdr.js';
import { cloudFile } from '../bag/clouds.js';
import { depthFile, usesOf } from '../bag/images.js';
import { scanLine } from '../bag/laser_scans.js';
import {
  decodeCamera,
  decodeCloud,
  decodeImage,
  decodeImageShape,
  decodeLivoxCloud,
  decodeScan,
  decodeStamp,
  TYPES,
} from '../bag/messages.js';
import { typeOf } from '../bag/open.js';
import { pinholeOf } from '../bag/recording.js';
import { lookUp } from '../base/look_up.js';
import { hintOf } from '../files/names.js';
import { cameraFor, engineCamera } from '../recording/camera_file.js';
import type { Offered } from './source.js';

/** A message of a topic, as CDR. */
export type Message = { topic: Offered; bytes: Uint8Array };
/** What a map is made of. */
export type MapSource = 'depth' | 'clouds' | 'scans';

export function messageOf(topic: Offered, data: Uint8Array): Message {
  return { topic, bytes: topic.encoding === 'ros1' ? encapsulateRos1(data) : data };
}

/** What messages of a topic are to people; undefined where they are not read. */
export function kindOf({ type, encoding }: Offered) {
  return encoding === 'cdr' || encoding === 'ros1' ? lookUp(TYPES, typeOf(type)) : undefined;
}

/** Which map can be made of these messages while they come, if any; images are depth by their names and encoding. */
export function mapSourceOf({ topic, bytes }: Message): MapSource | null {
  const kind = kindOf(topic);
  if (kind === 'cloud' || kind === 'livox cloud') return 'clouds';
  if (kind === 'laser scan') return 'scans';
  const isDepth =
    kind === 'image' && hintOf(topic.name) === 'depth' && usesOf(decodeImageShape(bytes).encoding).includes('depth');
  return isDepth ? 'depth' : null;
}

/** A depth image or a cloud as a file, with its time (s). */
export function frameOf({ topic, bytes }: Message): { time: number; file: Uint8Array } {
  const { sec, nsec } = decodeStamp(bytes);
  const kind = kindOf(topic);
  const file =
    kind === 'image'
      ? depthFile(decodeImage(bytes))
      : cloudFile((kind === 'livox cloud' ? decodeLivoxCloud : decodeCloud)(bytes));
  return { time: sec + nsec / 1e9, file };
}

/** A laser scan as a line of a log. */
export function logLineOf({ topic, bytes }: Message): string {
  return scanLine(decodeScan(bytes, topic.type.endsWith('/MultiEchoLaserScan')));
}

/** The camera of these depth images, as the engine reads it; null where it is not calibrated. */
export function cameraFileOf(camera: Message, depth: Offered): Uint8Array | null {
  const pinhole = pinholeOf(decodeCamera(camera.bytes), camera.topic.name, depth.name);
  if (!pinhole) return null;
  const text = new TextEncoder().encode(JSON.stringify(pinhole));
  return engineCamera(cameraFor('camera.json', text, pinhole).camera);
}
