// @ts-check
/** What `npm test` counts: what the runners print, and the last line. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { believe, countCargo, countNode, countPlaywright, noWarnings } from '../../scripts/counts.mjs';
import { runStages, sumOf } from '../../scripts/stages.mjs';

const CARGO = `
     Running tests/clean.rs (target/debug/deps/clean-1)

running 3 tests
test one ... ok
skipped: ../shared/data/laser/zju10 is absent
test two ... skipped: ../shared/data/rgbd is absent
ok
test three ... ignored

test result: ok. 2 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.01s

     Running tests/search.rs (target/debug/deps/search-2)

running 9 tests
test result: FAILED. 8 passed; 1 failed; 0 ignored; 0 measured; 0 filtered out; finished in 1.42s
`;

test('Rust tests that lack a recording are skipped, not passed', () => {
  assert.deepEqual(countCargo(CARGO), { passed: 8, failed: 1, skipped: 3 });
  const browser = 'test result: ok. 7 passed; 0 failed; 0 ignored; 0 filtered out; finished in 0.22s\n';
  assert.deepEqual(countCargo(browser), { passed: 7, failed: 0, skipped: 0 });
  assert.deepEqual(countCargo('error: could not compile'), { passed: 0, failed: 0, skipped: 0 });
});

test('a compilation that warns has failed, one that asks the network again has not', () => {
  const [passed, failed] = [
    { passed: 1, failed: 0, skipped: 0 },
    { passed: 0, failed: 1, skipped: 0 },
  ];
  const retried = 'warning: spurious network error (3 tries remaining): [6] Could not resolve hostname\n';
  const warned = 'warning: unused variable: `x`\n --> crate/src/lib.rs:1:5\n';
  assert.deepEqual(noWarnings({ code: 0, output: '   Compiling scanstitch v0.1.0\n' }), passed);
  assert.deepEqual(noWarnings({ code: 0, output: retried }), passed);
  for (const output of [warned, retried + warned]) assert.deepEqual(noWarnings({ code: 0, output }), failed);
  assert.deepEqual(noWarnings({ code: 101, output: retried }), failed);
});

test('Node and Playwright tell what they skipped', () => {
  const spec = 'ℹ tests 9\nℹ suites 0\nℹ pass 4\nℹ fail 1\nℹ cancelled 1\nℹ skipped 2\nℹ todo 1\nℹ duration_ms 5\n';
  assert.deepEqual(countNode(spec), { passed: 4, failed: 2, skipped: 3 });
  const report = JSON.stringify({ stats: { expected: 5, unexpected: 1, flaky: 2, skipped: 3 } });
  assert.deepEqual(countPlaywright(report), { passed: 5, failed: 3, skipped: 3 });
});

test('a runner that failed without naming a test has failed once', () => {
  const none = { passed: 0, failed: 0, skipped: 0 };
  assert.deepEqual(believe(none, 101), { ...none, failed: 1 });
  assert.deepEqual(believe({ passed: 4, failed: 0, skipped: 0 }, 1), { passed: 4, failed: 1, skipped: 0 });
  assert.deepEqual(believe({ passed: 4, failed: 2, skipped: 1 }, 1), { passed: 4, failed: 2, skipped: 1 });
  assert.deepEqual(believe({ passed: 4, failed: 0, skipped: 1 }, 0), { passed: 4, failed: 0, skipped: 1 });
});

test('the last line names what was skipped where something was', () => {
  const outcome = { passed: 3, failed: 0, skipped: 0, milliseconds: 1, cpuSeconds: 1 };
  assert.deepEqual(sumOf([outcome, outcome]), { failed: 0, line: '6 passed, 0 failed' });
  const lacking = { ...outcome, failed: 1, skipped: 2 };
  assert.deepEqual(sumOf([outcome, lacking, lacking]), { failed: 2, line: '9 passed, 2 failed, 4 skipped' });
});

test('stages beside others and the last one are told in the order in which they stand', async () => {
  /** @type {string[]} */
  const order = [];
  let numMet = 0;
  const met = async () => {
    numMet += 1;
  };
  const stage = (
    /** @type {string} */ name,
    /** @type {Partial<import('../../scripts/stages.mjs').Stage>} */ more,
  ) => ({
    name,
    about: name,
    needs: [met],
    run: async () => {
      order.push(name);
      return { passed: 1, failed: 0, skipped: 0 };
    },
    ...more,
  });
  const broken = async () => {
    throw new Error('no compiler');
  };
  const stages = [
    stage('e2e', { last: true }),
    stage('rust', { needs: [met, broken] }),
    stage('types', { beside: true }),
    stage('docs', {}),
  ];
  const outcomes = new Map();
  const rows = await runStages(stages, outcomes);
  assert.equal(order.at(-1), 'e2e');
  assert.deepEqual(order.toSorted(), ['docs', 'e2e', 'types']);
  assert.equal(numMet, 1, 'what several need is done once');
  assert.deepEqual(
    rows.map((row) => row.split(/\s+/).slice(0, 5)),
    [
      ['e2e', '1', 'passed', '0', 'failed'],
      ['rust', '0', 'passed', '1', 'failed'],
      ['types', '1', 'passed', '0', 'failed'],
      ['docs', '1', 'passed', '0', 'failed'],
    ],
  );
});
