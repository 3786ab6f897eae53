// @ts-check
/** Arguments of any kind: every command either works or says in words what is wrong with them. */
import { existsSync } from 'node:fs';
import { resolve } from 'node:path';
import { convert } from '../../npm/cli/convert.js';
import { evaluate } from '../../npm/cli/evaluate.js';
import { CommandError } from '../../npm/cli/command.js';
import { bev } from '../../npm/cli/bev.js';
import { consistency } from '../../npm/cli/consistency.js';
import { icp } from '../../npm/cli/icp.js';
import { invoke } from '../../npm/cli/invocation.js';
import { mapQuality } from '../../npm/cli/map_quality.js';
import { reconstruct } from '../../npm/cli/reconstruct.js';
import { settings } from '../../npm/cli/settings.js';
import { strategies } from '../../npm/cli/strategies.js';
import { topics } from '../../npm/cli/topics.js';
import * as engine from '../../npm/index.js';

const COMMANDS = [bev, consistency, convert, evaluate, icp, mapQuality, reconstruct, settings, strategies, topics];
const WORDS = [
  ...['--out', '--set', '--preset', '--reference', '--workers', '--topic', '--map-format', '--recording', '--odometry'],
  ...['--align', '--by', '--metric', '--relation', '--delta', '--times', '--from', '--to', '--json', '--strategies'],
  ...[
    '--scene',
    '--points',
    '--pairs',
    '--refine',
    '--camera',
    '--radius',
    '--frames',
    '--intrinsics',
    '--table',
    '--sort',
    '--axes',
    '--half-widths',
    '--size',
    '--own',
  ],
  ...[
    'max_range=3',
    'metric=euclid',
    'constructor',
    '__proto__=1',
    'voxel_size=1e999',
    'depth=/a',
    'none',
    'nowhere.ply',
  ],
  ...[
    '1',
    '-1',
    '1e400',
    'NaN',
    '0x10',
    '',
    ' ',
    '-',
    '--',
    '=',
    'a=b=c',
    'pcd',
    'rpe',
    'top',
    'plain',
    '35deg',
    '\0',
    'é',
  ],
];
// Nothing is there, so that nothing can be written.
const ABSENT = 'no folder of this name';
/** What is printed does not matter. */
const UNSEEN = { stdout: { write() {} }, stderr: { write() {} } };

/** @param {import('./random.mjs').Random} random */
export async function commandLine(random) {
  await engine.load();
  const command = random.one(COMMANDS);
  const args = Array.from({ length: random.below(8) }, () =>
    random.below(6) === 0 ? random.text(WORDS, 3) : random.one(WORDS),
  )
    .flatMap((word) => (['-', '--out', '--to'].includes(word) ? [] : [word.replaceAll('\0', '')]))
    // The root of the disk and what else is there have nothing to do with what is tried, by `none/..`, too.
    .filter((word) => word.trim() === '' || !existsSync(resolve(word)));
  try {
    await invoke(UNSEEN, async () => command.run(engine, [...args, `${ABSENT}/a.tum`]));
  } catch (error) {
    if (!(error instanceof CommandError)) throw new Error(`${command.name} ${JSON.stringify(args)}`, { cause: error });
  }
  return new TextEncoder().encode(args.join(' '));
}
