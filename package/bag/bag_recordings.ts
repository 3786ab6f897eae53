/** From the files of a drop or a command to the recordings of the bags among them: the way in for the page and Node. */
import type { Note } from '../base/errors.js';
import type { OnWalk } from './container.js';
import { type Bag, type BagFile, openBags } from './open.js';
import { type BagRecording, recordingOfBag } from './recording.js';
import { type Choice, chooseAsWished, describeTopics, type TopicFacts, type Wishes } from './topics.js';

export type ListedBag = { bag: Bag; topics: TopicFacts[] };

/** Opens the bags and looks at what their topics hold. */
export async function listBags(
  files: readonly BagFile[],
  onWalk?: OnWalk,
): Promise<{ bags: ListedBag[]; notes: Note[] }> {
  const { bags, notes } = await openBags(files, onWalk);
  return { bags: await Promise.all(bags.map(async (bag) => ({ bag, topics: await describeTopics(bag) }))), notes };
}

/** The wishes that can be meant for this bag: a topic that another one has is not looked for in it. */
function wishesFor({ bag }: ListedBag, all: readonly ListedBag[], wishes: Wishes) {
  const entries = Object.entries(wishes).filter(([, name]) => {
    return name === null || bag.topic(name) || !all.some((other) => other.bag.topic(name));
  });
  return Object.fromEntries(entries) as Wishes;
}

/**
 * The recording that the topics of each bag make.
 * @param onProgress messages looked into, of one bag after the other
 */
export async function recordingsOf(
  bags: readonly ListedBag[],
  wishes: Wishes,
  onProgress?: (done: number, total: number) => void,
): Promise<Awaited<ReturnType<typeof recordingOf>>[]> {
  const recordings = [];
  for (const listed of bags) recordings.push(await recordingOf(listed, wishesFor(listed, bags, wishes), onProgress));
  return recordings;
}

/**
 * The recording that the topics of a bag make.
 * @param onProgress messages looked into
 * @returns rejects with a ScanstitchError where a wish cannot be granted
 */
async function recordingOf(
  { bag, topics }: ListedBag,
  wishes: Wishes,
  onProgress?: (done: number, total: number) => void,
): Promise<BagRecording & { choice: Choice }> {
  const choice = chooseAsWished(bag.path, topics, wishes);
  return { ...(await recordingOfBag(bag, topics, choice, onProgress)), choice };
}
