/** `scanstitch topics`: what is in a bag, and what of it would be used. */
import { chooseAsWished, ROLES, type TopicFacts, type Wishes } from '../bag/topics.js';
import { printable } from '../base/printable.js';
import { type Command, CommandError, type Engine, readArguments, table } from './command.js';
import { openBags } from './inputs.js';
import { Complaints, print, tellNotes } from './terminal.js';
import { readWishes } from './wishes.js';

const OPTIONS = { topic: { type: 'string', multiple: true } } as const;

export const topics: Command = {
  name: 'topics',
  about: 'topics of a ROS bag, and which of them would be used',
  help: () => `scanstitch topics BAG... [--topic ROLE=NAME]...

Lists the topics of bags of ROS 1 (.bag) and ROS 2 (.db3, with or without metadata.yaml, or .mcap; folders and ZIP
archives of them): how many messages each has, how many a second, what they hold, and what reconstruct would use it as.
A bag of several files is one where they are given together.

Options:
  --topic ROLE=NAME  use this topic as depth, color, camera, clouds, scans, imu, odometry or reference; none: do
                     without

Examples:
  scanstitch topics walk.mcap
  scanstitch topics bags/ --topic clouds=/velodyne_points
`,
  run,
};

async function run(_engine: Engine, args: string[]) {
  const { values, positionals } = readArguments('topics', { args, options: OPTIONS, allowPositionals: true });
  if (positionals.length === 0) throw new CommandError('No bag was given. See: scanstitch topics --help');
  const wishes = readWishes(values.topic);
  const complaints = new Complaints();
  const { complain } = complaints;
  const { bags, notes, close } = await openBags(positionals, complain);
  try {
    tellNotes([...notes, ...bags.flatMap(({ bag }) => bag.notes)], complain);
    if (bags.length === 0) throw new CommandError('No bag could be opened.');
    for (const { bag, topics } of bags) print(`${printable(bag.path)}\n${list(bag.path, topics, wishes)}\n`);
  } finally {
    await close();
  }
  return complaints.exitCode;
}

function list(bag: string, topics: TopicFacts[], wishes: Wishes) {
  const choice = chooseAsWished(bag, topics, wishes);
  const rows = topics.map(({ topic, about, problem }) => {
    const role = ROLES.find((role) => choice[role] === topic.name);
    const rate = topic.rate === null ? '' : topic.rate.toFixed(1);
    return [topic.name, topic.type, String(topic.count), rate, role ?? '-', problem ? `not used: ${problem}` : about];
  });
  return table(['topic', 'type', 'messages', 'a second', 'used as', ''], rows, new Set([0, 1, 4, 5]));
}
