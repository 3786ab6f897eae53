/**
 * A bag as a recording: what its chosen topics hold, as files of standard formats that are made when they are read, and
 * how they belong together.
 */
import { append } from '../base/append.js';
import { joined } from '../base/bytes.js';
import { fileError, lost, type Note } from '../base/errors.js';
import { groupBy } from '../files/names.js';
import { pairUp } from '../files/pairs.js';
import { empty, type Recording } from '../files/recording.js';
import { CdrReader, MessageError } from './cdr.js';
import { cloudFile } from './clouds.js';
import { Gyroscope } from './gyro.js';
import { colorEnding, colorFile, depthEnding, depthFile } from './images.js';
import { type FramedLine, ofOneLaser, scanLine } from './laser_scans.js';
import {
  type CameraMessage,
  decodeCamera,
  decodeCloud,
  decodeCompressed,
  decodeImage,
  decodeLivoxCloud,
  decodeScan,
  type ImageMessage,
} from './messages.js';
import type { Bag, Topic } from './open.js';
import { packedEnding, packedFile } from './packed_images.js';
import { pathText, treeOf } from './path.js';
import type { Role } from './roles.js';
import { plural, stampedMessages, stampOf, timeText } from './stamps.js';
import { type Choice, cloudRank, type TopicFacts } from './topics.js';

/** A file that is made of messages when it is read. */
export interface BagContent {
  path: string;
  /** Of the messages, about; 1 where it is unknown. */
  size: number;
  /** Rejects with a ScanstitchError. */
  read: () => Promise<Uint8Array>;
  /** What could not be read of it, once it has been read. */
  losses?: Note[];
}
export type BagRecording = { files: BagContent[]; recording: Recording };

type TimedContent = BagContent & { time: bigint };

/** Of scans that do not say the step between their readings. */
const STEP_FROM_LIMITS = 'its angle_increment is 0: the readings are spread evenly from angle_min to angle_max';
/** Of a laser that hangs upside down the z axis points down to within 45 degrees. */
const UPRIGHT = Math.SQRT1_2;
/** Why there are no colours, where two clocks were at work. */
const NO_PAIRS = 'none of its times lies within 0.02 s of a depth image: the map is made without colours';

/** @param onProgress messages looked into */
export async function recordingOfBag(
  bag: Bag,
  topics: readonly TopicFacts[],
  choice: Choice,
  onProgress: (done: number, total: number) => void = () => {},
): Promise<BagRecording> {
  const made = new Maker(bag, topics, onProgress);
  const chosen = (role: Role) => topics.find(({ topic }) => topic.name === choice[role]) ?? null;
  const [depth, clouds, scans] = [chosen('depth'), chosen('clouds'), chosen('scans')];
  const source = depth ?? clouds ?? scans;
  if (depth) await made.takeDepth(depth, chosen('color'), chosen('camera'));
  else if (clouds) await made.takeClouds(clouds, chosen('imu'));
  else if (scans) await made.takeScans(scans);
  else made.tellOfWhatLacksAMap();
  const [odometry, reference] = [chosen('odometry'), chosen('reference')];
  if (scans && odometry) await made.takeOdometry(odometry, scans);
  if (source && reference) await made.takeReference(reference, source);
  return made.finish(choice);
}

class Maker {
  #files: BagContent[] = [];
  #recording: Recording;
  #bag;
  #topics;
  #onProgress;
  /** Topics that tell of the chosen ones. */
  #optionsRead: string[] = [];
  #total = 0;

  constructor(bag: Bag, topics: readonly TopicFacts[], onProgress: (done: number, total: number) => void) {
    this.#bag = bag;
    this.#topics = topics;
    this.#onProgress = onProgress;
    this.#recording = { ...empty(), root: bag.path, notes: [...bag.notes] };
  }

  /** Other sensors of the same kind, of which a map could be made as well. */
  #tellOfOthers(used: TopicFacts, role: 'clouds' | 'scans') {
    const rank = role === 'clouds' ? cloudRank(used) : 1;
    const others = this.#topics.filter((facts) => {
      const isAlike = facts !== used && facts.uses.includes(role) && facts.topic.count > 0;
      return isAlike && facts.frame !== used.frame && (role === 'scans' || cloudRank(facts) === rank);
    });
    if (others.length === 0) return;
    const names = others.map(({ topic, frame }) => `${topic.name} (frame ${frame || 'without a name'})`).join(', ');
    this.#note(
      used.topic.name,
      `one sensor is used at a time, this one; not used: ${names}. Choose it as ${role} to map it instead`,
    );
  }

  /** What a bag lacks that has nothing but pictures, or an inertial unit. */
  tellOfWhatLacksAMap() {
    for (const { topic, uses } of this.#topics) {
      if (uses.includes('imu')) this.#note(topic.name, 'not used: it helps to register clouds, and there are none');
    }
    const pictures = this.#topics.find(({ topic, uses }) => uses.includes('color') && topic.count > 0);
    if (!pictures) return;
    const { name } = pictures.topic;
    const remedy = `record its depth as well: ros2 bag record ${name} /camera/depth/image_rect_raw /camera/depth/camera_info`;
    this.#note(name, `not used: pictures without depth images, of which no map can be made; ${remedy}`);
  }

  async takeDepth(depth: TopicFacts, color: TopicFacts | null, camera: TopicFacts | null) {
    this.#total = depth.topic.count + (color?.topic.count ?? 0);
    const ending = await this.#endingOf(depth, depthEnding);
    const depths = await this.#contents(depth.topic, 'depth', ending, (bytes) => imageFile(depth, bytes, depthFile));
    const colors = color
      ? await this.#contents(color.topic, 'color', await this.#endingOf(color, colorEnding), (bytes) =>
          imageFile(color, bytes, colorFile),
        )
      : [];
    const member = ({ path, size, time }: TimedContent) => ({
      path,
      size,
      key: path,
      time: Number(time) / 1e9,
    });
    const { pairs, unused } = pairUp(depths.map(member), colors.map(member), false);
    const bare = pairs.filter(({ color }) => !color).length;
    if (color && bare === pairs.length) this.#note(color.topic.name, NO_PAIRS);
    else if (color) {
      if (bare > 0)
        this.#note(
          depth.topic.name,
          `${plural(bare, 'depth image')} without a colour image within 0.02 s, used without colours`,
        );
      if (unused.length > 0)
        this.#note(color.topic.name, `${plural(unused.length, 'colour image')} not used: no depth image within 0.02 s`);
    }
    this.#recording.depth_frames = pairs.map(({ depth: { path, time }, color }) => {
      return { name: path.slice(this.#bag.path.length + 1), depth: path, color: color?.path ?? null, time };
    });
    if (depths.length > 0) this.#recording.kind = 'depth_images';
    if (camera) await this.#takeCamera(camera, depth);
  }

  async takeClouds(clouds: TopicFacts, imu: TopicFacts | null) {
    const { topic } = clouds;
    this.#tellOfOthers(clouds, 'clouds');
    this.#total = topic.count;
    const decode = topic.type.endsWith('/CustomMsg') ? decodeLivoxCloud : decodeCloud;
    const contents = await this.#contents(topic, 'clouds', 'pcd', (bytes) => cloudFile(decode(bytes)));
    if (imu) await this.#addGyroscope(contents, imu, clouds);
    this.#recording.clouds = contents.map(({ path }) => path);
    this.#recording.cloud_times = contents.map(({ time }) => Number(time) / 1e9);
    if (contents.length > 0) this.#recording.kind = 'clouds';
  }

  /** What an inertial unit measured around each cloud goes into its file. */
  async #addGyroscope(contents: TimedContent[], imu: TopicFacts, clouds: TopicFacts) {
    const { gyroscope, notes } = await Gyroscope.open(this.#bag, this.#topics, imu, clouds);
    append(this.#recording.notes, notes);
    for (const [index, content] of contents.entries()) {
      const [before = content, after = content] = [contents[index - 1], contents[index + 1]];
      const { read } = content;
      content.read = async () => {
        const file = await read();
        return joined([await gyroscope.comments([before.time, content.time, after.time]), file]);
      };
    }
  }

  /** One log of all scans. */
  async takeScans(scans: TopicFacts) {
    const { topic, frame } = scans;
    this.#tellOfOthers(scans, 'scans');
    this.#total = topic.count;
    const tree = await treeOf(this.#bag, this.#topics, true, []);
    const isUpsideDown = (tree.uprightness(frame) ?? 1) < -UPRIGHT;
    if (isUpsideDown) this.#note(topic.name, `${frame} hangs upside down by /tf: its readings are turned over`);
    const { messages, notes } = await stampedMessages(this.#bag, topic, (done) => this.#onProgress(done, this.#total));
    append(this.#recording.notes, notes);
    if (messages.length === 0) return;
    const hasEchoes = topic.type.endsWith('/MultiEchoLaserScan');
    const path = `${this.#bag.path}/${topic.name.replace(/^\//, '').replaceAll('/', '_')}.log`;
    const losses: Note[] = [];
    const read = async () => {
      const scansRead: FramedLine[] = [];
      const faults: string[] = [];
      let numWithoutStep = 0;
      const lineOf = (bytes: Uint8Array, time: bigint) => {
        const scan = decodeScan(bytes, hasEchoes);
        if (scan.angleIncrement === 0) numWithoutStep += 1;
        return { frame: scan.frame, line: scanLine({ ...scan, stamp: stampOf(time) }, isUpsideDown) };
      };
      for (const { index, time } of messages) {
        try {
          scansRead.push(await this.#convert(topic, index, path, (bytes) => lineOf(bytes, time)));
        } catch (error) {
          faults.push(wordsOf(error));
        }
      }
      if (scansRead.length === 0) throw fileError(path, `None of its scans can be read. ${faults[0] ?? ''}`);
      const { lines, loss } = ofOneLaser(scansRead);
      const some = `${plural(faults.length, 'scan')} of ${messages.length} left out: ${faults[0] ?? ''}`;
      losses.splice(0, Infinity, ...(faults.length > 0 ? [lost(topic.name, some)] : []));
      if (loss) losses.push(lost(topic.name, loss));
      if (numWithoutStep > 0) losses.push({ file: topic.name, reason: STEP_FROM_LIMITS });
      return new TextEncoder().encode(`${lines.join('\n')}\n`);
    };
    this.#files.push({ path, size: 1, read, losses });
    this.#recording.scans = [path];
    this.#recording.logs = [path];
    this.#recording.kind = 'planar_scans';
  }

  async takeReference(reference: TopicFacts, source: TopicFacts) {
    this.#recording.reference = await this.#pathFile(reference, source, true);
  }

  async takeOdometry(odometry: TopicFacts, scans: TopicFacts) {
    const [path = null] = await this.#pathFile(odometry, scans, false);
    this.#recording.odometry = path;
  }

  /**
   * The path of the source's frame that a topic tells, as one file; none where it tells none.
   * @param isCompared whether nothing is computed from it
   */
  async #pathFile({ topic }: TopicFacts, source: TopicFacts, isCompared: boolean) {
    const onProgress = (done: number) => this.#onProgress(done, topic.count);
    const options = { isCompared, onProgress };
    const { text, notes } = await pathText(this.#bag, this.#topics, topic, source.frame, options);
    append(this.#recording.notes, notes);
    if (text === null) return [];
    const path = `${this.#bag.path}/${topic.name.replace(/^\//, '').replaceAll('/', '_')}.tum`;
    const bytes = new TextEncoder().encode(text);
    this.#files.push({ path, size: bytes.length, read: async () => bytes.slice() });
    return [path];
  }

  finish(choice: Choice): BagRecording {
    const used = new Set([...Object.values(choice), ...this.#optionsRead]);
    const faulty = this.#topics.filter(
      ({ problem, topic }) => problem !== '' && topic.count > 0 && !used.has(topic.name),
    );
    for (const [problem, topics] of groupBy(faulty, ({ problem }) => problem)) {
      const names = topics.map(({ topic }) => `${topic.name} (${topic.type})`);
      const shown =
        names.length > 4 ? `${names.slice(0, 3).join(', ')} and ${names.length - 3} more` : names.join(', ');
      this.#note(this.#bag.path, `not used: ${shown}: ${problem}`);
    }
    return { files: this.#files, recording: this.#recording };
  }

  async #takeCamera({ topic }: TopicFacts, { topic: depthTopic, size }: TopicFacts) {
    for (let index = 0; index < Math.min(topic.count, 10); index += 1) {
      try {
        const message = decodeCamera(await this.#bag.read(topic, index));
        const camera = pinholeOf(message, topic.name, depthTopic.name);
        if (!camera) continue;
        const images = `describes images of ${camera.width} x ${camera.height} pixels, and the depth has ${size?.join(' x ')}`;
        if (size && camera.width * size[1] !== camera.height * size[0]) {
          this.#note(topic.name, `${images}; not used`);
          return;
        }
        if (size && camera.width !== size[0]) this.#note(topic.name, `${images}: it is scaled to these`);
        if (message.d.some((value) => value !== 0) && !/rect/.test(depthTopic.name)) {
          this.#note(
            topic.name,
            `the lens distorts (${message.model || 'model unknown'}), which is not undone; rectified depth gives a more accurate map`,
          );
        }
        const unit = await this.#depthUnit(depthTopic.name);
        const known = {
          ...scaledTo(camera, size?.[0] ?? camera.width),
          ...(unit !== null && { depth_scale: 1 / unit }),
        };
        const bytes = new TextEncoder().encode(`${JSON.stringify(known)}\n`);
        const path = `${this.#bag.path}/depth-camera.json`;
        this.#files.push({ path, size: bytes.length, read: async () => bytes.slice() });
        this.#recording.intrinsics = path;
        return;
      } catch (error) {
        if (index === 0) this.#note(topic.name, `its first message cannot be used: ${wordsOf(error)}`);
      }
    }
  }

  /** Metres per unit of depth, where RealSense's viewer recorded that option of the sensor; null where it did not. */
  async #depthUnit(depth: string) {
    const [sensor = ''] = /^\/device_\d+\/sensor_\d+/.exec(depth) ?? [];
    const option = this.#bag.topics.find(({ name }) => name === `${sensor}/option/Depth_Units/value`);
    if (!option || option.type !== 'std_msgs/msg/Float32') return null;
    const unit = new CdrReader(await this.#bag.read(option, 0)).f32('data');
    this.#optionsRead.push(option.name);
    return unit > 0 && unit < 1 ? Number(unit.toPrecision(7)) : null;
  }

  async #endingOf({ topic, encoding }: TopicFacts, rawEnding: (encoding: string) => string) {
    if (topic.type !== 'sensor_msgs/msg/CompressedImage') return rawEnding(encoding);
    try {
      const { format, data } = decodeCompressed(await this.#bag.read(topic, 0));
      return packedEnding(format, data);
    } catch {
      return /jpe?g/i.test(encoding) ? 'jpg' : 'png';
    }
  }

  /** A file for each message, named by its time. */
  async #contents(
    topic: Topic,
    folder: string,
    ending: string,
    convert: (bytes: Uint8Array) => Uint8Array,
  ): Promise<TimedContent[]> {
    const before = folder === 'color' ? this.#total - topic.count : 0;
    const { messages, notes } = await stampedMessages(this.#bag, topic, (done) =>
      this.#onProgress(before + done, this.#total),
    );
    append(this.#recording.notes, notes);
    const contents = messages.map(({ index, time }) => {
      const path = `${this.#bag.path}/${folder}/${timeText(time)}.${ending}`;
      return { path, size: 1, time, read: () => this.#convert(topic, index, path, convert) };
    });
    append(this.#files, contents);
    return contents;
  }

  async #convert<T>(topic: Topic, index: number, path: string, convert: (bytes: Uint8Array) => T): Promise<T> {
    try {
      return convert(await this.#bag.read(topic, index));
    } catch (error) {
      if (error instanceof MessageError) {
        throw fileError(path, `Message ${index + 1} of ${topic.name}: ${error.problem}`, error.remedy);
      }
      const { problem, remedy } = error as { problem?: string; remedy?: string };
      throw problem === undefined ? error : fileError(path, problem, remedy);
    }
  }

  #note(file: string, reason: string) {
    this.#recording.notes.push({ file, reason });
  }
}

function imageFile({ topic }: TopicFacts, bytes: Uint8Array, rawFile: (image: ImageMessage) => Uint8Array) {
  return topic.type === 'sensor_msgs/msg/CompressedImage'
    ? packedFile(decodeCompressed(bytes))
    : rawFile(decodeImage(bytes));
}

/**
 * The camera of the images as they are sent: binned, and cut to a region; of rectified ones their own (CameraInfo's P).
 */
export function pinholeOf({ width, height, k, p, binning, region }: CameraMessage, topic: string, depthTopic: string) {
  const isRectified = /rect/.test(`${topic} ${depthTopic}`) && (p[0] ?? 0) > 0;
  const [fx = 0, , cx = 0, , , fy = 0, cy = 0] = isRectified
    ? [p[0], 0, p[2], 0, 0, p[5], p[6]]
    : [k[0], 0, k[2], 0, 0, k[4], k[5]];
  if (!(fx > 0 && fy > 0)) return null; // not calibrated
  const [binX, binY] = [Math.max(1, binning[0]), Math.max(1, binning[1])];
  return {
    width: Math.floor((region.width || width) / binX),
    height: Math.floor((region.height || height) / binY),
    fx: fx / binX,
    fy: fy / binY,
    cx: (cx - region.x) / binX,
    cy: (cy - region.y) / binY,
  };
}

/** The camera of images of another width and the same shape; pixels have their middles at whole numbers. */
function scaledTo(camera: NonNullable<ReturnType<typeof pinholeOf>>, width: number) {
  const factor = width / camera.width;
  const middle = (at: number) => (at + 0.5) * factor - 0.5;
  const { fx, fy, cx, cy } = camera;
  return {
    ...camera,
    width,
    height: camera.height * factor,
    fx: fx * factor,
    fy: fy * factor,
    cx: middle(cx),
    cy: middle(cy),
  };
}

function wordsOf(error: unknown) {
  const { problem, message } = error as Error & { problem?: string };
  return problem ?? message;
}
