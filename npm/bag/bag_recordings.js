// @ts-check
/** From the files of a drop or a command to the recordings of the bags among them: the way in for the page and Node. */
import { openBags } from './open.js';
import { recordingOfBag } from './recording.js';
import { chooseAsWished, describeTopics } from './topics.js';

/** @typedef {import('./open.js').Bag} Bag */
/** @typedef {import('./topics.js').TopicFacts} TopicFacts */
/** @typedef {import('./topics.js').Choice} Choice */
/** @typedef {import('./topics.js').Wishes} Wishes */
/** @typedef {{ bag: Bag, topics: TopicFacts[] }} ListedBag */

/**
 * Opens the bags and looks at what their topics hold.
 * @param {readonly import('./open.js').BagFile[]} files
 * @param {import('./open.js').OnWalk} [onWalk]
 * @returns {Promise<{ bags: ListedBag[], notes: import('../recording.js').Note[] }>}
 */
export async function listBags(files, onWalk) {
  const { bags, notes } = await openBags(files, onWalk);
  return { bags: await Promise.all(bags.map(async (bag) => ({ bag, topics: await describeTopics(bag) }))), notes };
}

/**
 * The wishes that can be meant for this bag: a topic that another one has is not looked for in it.
 * @param {ListedBag} listed
 * @param {readonly ListedBag[]} all
 * @param {Wishes} wishes
 */
function wishesFor({ bag }, all, wishes) {
  const entries = Object.entries(wishes).filter(([, name]) => {
    return name === null || bag.topic(name) || !all.some((other) => other.bag.topic(name));
  });
  return /** @type {Wishes} */ (Object.fromEntries(entries));
}

/**
 * The recording that the topics of each bag make.
 * @param {readonly ListedBag[]} bags
 * @param {Wishes} wishes
 * @param {(done: number, total: number) => void} [onProgress] messages looked into, of one bag after the other
 * @returns {Promise<Awaited<ReturnType<typeof recordingOf>>[]>}
 */
export async function recordingsOf(bags, wishes, onProgress) {
  const recordings = [];
  for (const listed of bags) recordings.push(await recordingOf(listed, wishesFor(listed, bags, wishes), onProgress));
  return recordings;
}

/**
 * The recording that the topics of a bag make.
 * @param {ListedBag} listed
 * @param {Wishes} wishes
 * @param {(done: number, total: number) => void} [onProgress] messages looked into
 * @returns {Promise<import('./recording.js').BagRecording & { choice: Choice }>} rejects with a ScanstitchError where a
 *    wish cannot be granted
 */
async function recordingOf({ bag, topics }, wishes, onProgress) {
  const choice = chooseAsWished(bag.path, topics, wishes);
  return { ...(await recordingOfBag(bag, topics, choice, onProgress)), choice };
}
