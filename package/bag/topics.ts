/** What each topic of a bag can be used as, and which ones are used unless somebody chooses others. */
import { fileError } from '../base/errors.js';
import { lookUp } from '../base/look_up.js';
import { hintOf } from '../files/names.js';
import { depthEnding, usesOf } from './images.js';
import {
  decodeCloudShape,
  decodeCompressedHead,
  decodeHeader,
  decodeImageShape,
  HEAD_BYTES,
  TYPES,
} from './messages.js';
import type { Bag, Topic } from './open.js';
import { useOfPacked } from './packed_images.js';
import { type Role, ROLES } from './roles.js';
import { whyUnread } from './unread_types.js';

export interface TopicFacts {
  topic: Topic;
  /** What its messages are, in a few words. */
  about: string;
  /** The frame they are given in. */
  frame: string;
  /** what it can be used as; empty: nothing */
  uses: Role[];
  /** Why it cannot be used; empty where it can. */
  problem: string;
  /** Of images; empty otherwise. */
  encoding: string;
  /** Of images, where it is known. */
  size: [width: number, height: number] | null;
}
/** The topic used as each; what is missing is not used. */
export type Choice = Partial<Record<Role, string>>;

export { ROLES };
/** Of these one is used at a time: what the map is made of. */
export const SOURCES: readonly Role[] = Object.freeze(['depth', 'clouds', 'scans']);

/** @returns in the order of the bag's topics */
export function describeTopics(bag: Bag): Promise<TopicFacts[]> {
  return Promise.all(bag.topics.map((topic) => describeTopic(bag, topic)));
}

async function describeTopic(bag: Bag, topic: Topic): Promise<TopicFacts> {
  const facts: TopicFacts = { topic, about: '', frame: '', uses: [], problem: '', encoding: '', size: null };
  const kind = lookUp(TYPES, topic.type);
  if (topic.format !== 'cdr' && topic.format !== 'ros1') {
    const problem = `serialised as ${topic.format}, and only cdr and ros1 are read; record it with the default middleware`;
    return { ...facts, problem: topic.format === '' ? 'how it is serialised is unknown' : problem };
  }
  if (kind === undefined) return { ...facts, problem: whyUnread(topic.type) };
  if (topic.count === 0) return { ...facts, problem: 'no messages' };
  try {
    return { ...facts, ...factsOf(kind, await bag.readHead(topic, 0, HEAD_BYTES)) };
  } catch (error) {
    const { problem, message } = error as Error & { problem?: string };
    return { ...facts, uses: usesOfKind(kind), about: `its first message cannot be read: ${problem ?? message}` };
  }
}

function usesOfKind(kind: string): Role[] {
  if (kind === 'cloud' || kind === 'livox cloud') return ['clouds'];
  if (kind === 'laser scan') return ['scans'];
  if (kind === 'camera') return ['camera'];
  if (kind === 'image' || kind === 'packed image') return ['depth', 'color'];
  if (kind === 'imu') return ['imu'];
  return kind === 'path' ? ['reference'] : ['odometry', 'reference'];
}

function factsOf(kind: string, head: Uint8Array): Partial<TopicFacts> {
  if (kind === 'image') {
    const { width, height, encoding, frame } = decodeImageShape(head);
    const uses = usesOf(encoding);
    const problem = uses.length > 0 ? '' : `images of the encoding ${encoding} are not read`;
    return { about: `${width} x ${height}, ${encoding}`, frame, uses, problem, encoding, size: [width, height] };
  }
  if (kind === 'packed image') {
    const { frame, format, start } = decodeCompressedHead(head);
    const use = useOfPacked(format, start);
    const problem = use ? '' : `images packed as "${format}" are not read`;
    return { about: format, frame, uses: use ? [use] : [], problem, encoding: format };
  }
  if (kind === 'cloud') {
    const { width, height, fields, frame } = decodeCloudShape(head);
    const names = fields.map(({ name }) => name);
    const isInSpace = ['x', 'y', 'z'].every((axis) => names.includes(axis));
    const about = `${width * height} points of ${names.join(' ')}`;
    return {
      about,
      frame,
      uses: isInSpace ? ['clouds'] : [],
      problem: isInSpace ? '' : 'its points have no x, y and z',
    };
  }
  const { frame } = kind === 'transforms' ? { frame: '' } : decodeHeader(head);
  return { about: frame && `frame ${frame}`, frame, uses: usesOfKind(kind) };
}

/**
 * The sensible choice: depth with its colours and its camera, or else clouds, or else laser scans; and what may be the
 * reference.
 */
export function chooseTopics(topics: readonly TopicFacts[]): Choice {
  const depth = best(topics, 'depth', depthRank);
  const clouds = best(topics, 'clouds', cloudRank);
  const scans = best(topics, 'scans', () => 1);
  const choice: Choice = {};
  if (depth && (depth.topic.count > 1 || !clouds)) choice.depth = depth.topic.name;
  else if (clouds) choice.clouds = clouds.topic.name;
  else if (scans) choice.scans = scans.topic.name;
  return complete(topics, choice);
}

/**
 * A choice with what belongs to its depth, clouds or scans where nothing was said about it.
 * @param settled what somebody has chosen, or chosen to do without
 */
export function complete(
  topics: readonly TopicFacts[],
  choice: Choice,
  settled: ReadonlySet<Role> = new Set(),
): Choice {
  const depth = topics.find(({ topic }) => topic.name === choice.depth);
  const made = { ...choice };
  const fill = (role: Role, found: TopicFacts | null | undefined) => {
    if (settled.has(role)) return;
    if (found) made[role] = found.topic.name;
    else delete made[role];
  };
  fill('color', depth && best(topics, 'color', (facts) => colorRank(facts, depth)));
  fill('camera', depth && cameraOf(topics, depth));
  const clouds = topics.find(({ topic }) => topic.name === choice.clouds);
  fill('imu', clouds && best(topics, 'imu', (facts) => imuRank(facts, clouds)));
  fill('odometry', choice.scans === undefined ? null : best(topics, 'odometry', odometryRank));
  const others = topics.filter(({ topic }) => topic.name !== made.odometry);
  fill('reference', SOURCES.some((role) => choice[role]) ? best(others, 'reference', referenceRank) : null);
  return made;
}

/** The one of the highest rank above zero; of equal ones the one with the most messages. */
function best(topics: readonly TopicFacts[], role: Role, rankOf: (facts: TopicFacts) => number) {
  const ranked = topics
    .filter(({ uses }) => uses.includes(role))
    .map((facts) => ({ facts, rank: rankOf(facts) }))
    .filter(({ rank }) => rank > 0);
  ranked.sort((a, b) => b.rank - a.rank || b.facts.topic.count - a.facts.topic.count);
  return ranked[0]?.facts ?? null;
}

function depthRank({ topic: { name }, encoding, uses }: TopicFacts) {
  const hint = hintOf(name);
  if (hint === 'aside') return 0;
  // A grey picture is depth only where it is called so.
  if (uses.includes('color') && hint !== 'depth') return 0;
  const isRaw = encoding === '16UC1' || depthEnding(encoding) === 'pfm';
  return (isRaw ? 3 : 2) + (/aligned|registered/.test(name) ? 3 : 0);
}

function colorRank({ topic, encoding, size }: TopicFacts, depth: TopicFacts) {
  const hint = hintOf(topic.name);
  if (topic === depth.topic || hint === 'aside' || hint === 'depth') return 0;
  // Colours are laid over the depth pixel by pixel.
  if (size && depth.size && (size[0] !== depth.size[0] || size[1] !== depth.size[1])) return 0;
  const common = sharedParts(topic.name, depth.topic.name);
  return 1 + 4 * Number(hint === 'color') + 2 * common + Number(/^(rgb|bgr)/.test(encoding) && size !== null);
}

/** The camera of the depth images: beside them, or in their frame. */
function cameraOf(topics: readonly TopicFacts[], depth: TopicFacts) {
  return best(topics, 'camera', ({ topic, frame }) => {
    const folder = topic.name.slice(0, topic.name.lastIndexOf('/') + 1);
    const isBeside = depth.topic.name.startsWith(folder) && folder !== '/';
    const isItsFrame = frame === depth.frame;
    if (!isBeside && !isItsFrame) return 0;
    return 1 + (isBeside ? 2 + sharedParts(topic.name, depth.topic.name) : 0) + Number(isItsFrame);
  });
}

/** How likely clouds are those of a sensor. */
export function cloudRank({ topic: { name } }: TopicFacts) {
  if (/(^|[/_])(map|octomap|costmap|global|obstacles?|ground|voxels?|plane)/i.test(name)) return 1;
  return /depth|camera/i.test(name) ? 2 : 3;
}

/** The inertial unit in the same device as the lidar comes first. */
function imuRank({ topic, frame }: TopicFacts, clouds: TopicFacts) {
  const isInCamera = /camera|realsense|zed|depth/i.test(topic.name);
  return 1 + 2 * sharedParts(topic.name, clouds.topic.name) + 4 * Number(frame === clouds.frame) - Number(isInCamera);
}

/** A topic named as ground truth comes first; wheel odometry comes last. */
function referenceRank({ topic: { name, type } }: TopicFacts) {
  if (/tf_static$/.test(name)) return 0;
  if (/goal|plan|command|cmd|target|setpoint|initialpose/i.test(name)) return 0;
  if (/(^|[/_])(gt|ground_?truth|truth|reference)/i.test(name)) return 6;
  if (/vicon|optitrack|mocap|qualisys|vrpn/i.test(name)) return 5;
  if (type === 'tf2_msgs/msg/TFMessage') return 4;
  return type === 'nav_msgs/msg/Odometry' ? 2 : 3;
}

/** What wheels or an inertial unit measured; ground truth is none. */
function odometryRank(facts: TopicFacts) {
  if (facts.topic.type !== 'nav_msgs/msg/Odometry' || referenceRank(facts) !== 2) return 0;
  return /odom/i.test(facts.topic.name) ? 2 : 1;
}

/** How many parts of their names are the same from the beginning. */
function sharedParts(a: string, b: string) {
  const [parts, others] = [a.split('/').slice(1), b.split('/').slice(1)];
  const differing = parts.findIndex((part, index) => part !== others[index]);
  return differing < 0 ? parts.length : differing;
}

/** What somebody wants each to be: the name of a topic, or null to do without. */
export type Wishes = Partial<Record<Role, string | null>>;

/**
 * The sensible choice, changed as somebody wishes.
 * @param bag for messages
 * @returns throws a ScanstitchError where a topic is not there or cannot be used as that
 */
export function chooseAsWished(bag: string, topics: readonly TopicFacts[], wishes: Wishes): Choice {
  const settled = new Set(ROLES.filter((role) => role in wishes));
  const sources = SOURCES.filter((role) => wishes[role]);
  if (sources.length > 1) {
    throw fileError(bag, `A map is made of one of ${sources.join(' and ')}`, 'Choose one of them');
  }
  const choice: Choice =
    sources.length > 0 ? {} : chooseTopics(topics.filter(({ topic }) => !hasOtherRole(topic.name, wishes)));
  for (const role of settled) {
    const name = wishes[role];
    delete choice[role];
    if (name === null || name === undefined) continue;
    const facts = topics.find(({ topic }) => topic.name === name);
    if (!facts) {
      throw fileError(bag, `It has no topic ${name}`, `It has ${topics.map(({ topic }) => topic.name).join(', ')}`);
    }
    if (!facts.uses.includes(role)) {
      const can = facts.uses.length > 0 ? `It can be used as ${facts.uses.join(' or ')}` : 'Choose another topic';
      const why = facts.problem === '' ? facts.topic.type : facts.problem;
      throw fileError(bag, `${name} cannot be used as ${role} (${why})`, can);
    }
    choice[role] = name;
  }
  return complete(topics, choice, settled);
}

/** Whether it is wished for in a role other than that of a source. */
function hasOtherRole(name: string, wishes: Wishes) {
  return ROLES.some((role) => wishes[role] === name && !SOURCES.includes(role));
}
