// @ts-check
/** A little of what `npm run fuzz` does, with the same seeds every time. */
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { join } from 'node:path';
import { test } from 'node:test';
import { commandLine } from '../../scripts/fuzz/arguments.mjs';
import { bags, messages } from '../../scripts/fuzz/bags.mjs';
import { conversion } from '../../scripts/fuzz/conversion.mjs';
import { classification, zips } from '../../scripts/fuzz/files.mjs';
import { Random } from '../../scripts/fuzz/random.mjs';
import { ROOT } from './support.mjs';

const ROUNDS = { messages: 2000, bags: 60, zips: 60, classification: 60, conversion: 300, commandLine: 100 };

for (const [name, round] of Object.entries({ messages, bags, zips, classification, conversion, commandLine })) {
  test(`damaged input: ${name}`, async () => {
    const rounds = ROUNDS[/** @type {keyof typeof ROUNDS} */ (name)];
    for (let seed = 0; seed < rounds; seed += 1) {
      await assert.doesNotReject(round(new Random(seed)), `seed ${seed}`);
    }
  });
}

test('the command of the fuzzer runs a target, and knows its targets', () => {
  const run = (/** @type {string[]} */ ...args) =>
    spawnSync(process.execPath, [join(ROOT, 'scripts', 'fuzz.mjs'), ...args], { encoding: 'utf8' });
  const { status, stdout } = run('--time', '1', 'messages');
  assert.match(
    stdout,
    /^messages: \d+ inputs of at most \d+ bytes in 1 s, from seed 1 on: clean; at most [\d.]+ MB of memory for one input, of \d+ bytes \(seed \d+\)$/m,
  );
  assert.equal(status, 0);
  const unknown = run('everything');
  assert.match(unknown.stdout + unknown.stderr, /No target is called everything\. There are: messages, bags, zips/);
  assert.equal(unknown.status, 1);
});
