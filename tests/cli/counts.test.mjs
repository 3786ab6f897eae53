// @ts-check
/** What `npm test` counts: what the runners print, and the last line. */
import assert from 'node:assert/strict';
import { PassThrough } from 'node:stream';
import { test } from 'node:test';
import { afterSecondTry, believe, countCargo, countNode, countPlaywright, noWarnings } from '../../scripts/counts.mjs';
import { currentWork, isProgress, tellOn, track } from '../../scripts/progress.mjs';
import { failuresOf, NUM_AT_A_TIME, runStages, sumOf, tableOf } from '../../scripts/stages.mjs';

// What the stages tell belongs to no test.
tellOn(new PassThrough().resume());

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
test search::nearest ... FAILED

failures:

---- search::nearest stdout ----

thread 'search::nearest' panicked at search.rs:7:5:
left: 1

failures:
    search::nearest

test result: FAILED. 8 passed; 1 failed; 0 ignored; 0 measured; 0 filtered out; finished in 1.42s
`;

test('Rust tests that lack a recording are skipped, not passed', () => {
  const failures = ["search::nearest\n    thread 'search::nearest' panicked at search.rs:7:5:\n    left: 1"];
  assert.deepEqual(countCargo(CARGO), { passed: 8, failed: 1, skipped: 3, failures });
  const browser = 'test result: ok. 7 passed; 0 failed; 0 ignored; 0 filtered out; finished in 0.22s\n';
  assert.deepEqual(countCargo(browser), { passed: 7, failed: 0, skipped: 0, failures: [] });
  assert.deepEqual(countCargo('error: could not compile'), { passed: 0, failed: 0, skipped: 0, failures: [] });
});

test('a compilation that warns has failed, one that asks the network again has not', () => {
  const retried = 'warning: spurious network error (3 tries remaining): [6] Could not resolve hostname\n';
  const warned = 'warning: unused variable: `x`\n --> crate/src/lib.rs:1:5\n';
  const passed = { passed: 1, failed: 0, skipped: 0, failures: [] };
  assert.deepEqual(noWarnings({ code: 0, output: '   Compiling scanstitch v0.1.0\n' }), passed);
  assert.deepEqual(noWarnings({ code: 0, output: retried }), passed);
  const told = '1 warnings and errors\n    warning: unused variable: `x`\n     --> crate/src/lib.rs:1:5';
  for (const output of [warned, retried + warned]) {
    assert.deepEqual(noWarnings({ code: 0, output }), { passed: 0, failed: 1, skipped: 0, failures: [told] });
  }
  assert.equal(noWarnings({ code: 101, output: retried }).failed, 1);
});

test('Node and Playwright tell what they skipped, and what failed and why', () => {
  const spec = 'ℹ tests 9\nℹ suites 0\nℹ pass 4\nℹ fail 1\nℹ cancelled 1\nℹ skipped 2\nℹ todo 1\nℹ duration_ms 5\n';
  assert.deepEqual(countNode(spec), { passed: 4, failed: 2, skipped: 3, failures: [] });
  const told = `${spec}\n✖ failing tests:\n\ntest at a.test.mjs:2:1\n✖ one is two (3.46ms)\n  Error: no\n      at node:internal/x:1:2\n
test at b.test.mjs:7:1\n✖ ends\n  'timed out'\n`;
  assert.deepEqual(countNode(told).failures, [
    'a.test.mjs:2:1 one is two\n      Error: no',
    "b.test.mjs:7:1 ends\n      'timed out'",
  ]);
  const errors = [{ message: '\u001b[31mnot\u001b[39m seen\n\nCall log' }];
  const specOf = (/** @type {boolean} */ ok) => ({
    ...{ file: 'a.spec.ts', line: 3, title: 'stops', ok },
    tests: [{ results: [{ errors }] }],
  });
  const suites = [{ suites: [{ specs: [specOf(false), specOf(true)] }] }];
  const report = JSON.stringify({ stats: { expected: 5, unexpected: 1, flaky: 2, skipped: 3 }, suites });
  const failures = ['a.spec.ts:3 stops\n    not seen\n    Call log'];
  assert.deepEqual(countPlaywright(report), { passed: 5, failed: 3, skipped: 3, failures });
});

test('what passes at the second try is unsteady and told, what fails twice has failed', () => {
  const first = { passed: 7, failed: 2, skipped: 1, failures: ['a\n    late', 'b\n    wrong'] };
  const second = { passed: 1, failed: 1, skipped: 0, failures: ['b\n    wrong again'] };
  const counts = { passed: 8, failed: 1, skipped: 1, failures: second.failures, unsteady: ['a\n    late'] };
  assert.deepEqual(afterSecondTry(first, second), counts);
  assert.deepEqual(
    afterSecondTry(first, { ...second, passed: 0 }),
    first,
    'a second try that did not run says nothing',
  );
  const outcome = { counts, failed: false, milliseconds: 1, cpuSeconds: 1, waited: '' };
  assert.deepEqual(sumOf([outcome]), { failed: 1, line: '8 passed, 1 failed, 1 skipped, 1 unsteady' });
  const stage = (/** @type {string} */ name) => ({ name, about: '', run: async () => counts });
  const outcomes = new Map();
  outcomes.set(stage('e2e'), outcome).set(stage('docs'), { ...outcome, counts: null, failed: true });
  assert.deepEqual(failuresOf(outcomes), [
    'failed: e2e: b\n    wrong again',
    'unsteady, passed when it was tried again: e2e: a\n    late',
    'failed: docs: see its output above',
  ]);
});

test('a runner that failed without naming a test has failed once', () => {
  const none = { passed: 0, failed: 0, skipped: 0 };
  assert.deepEqual(believe(none, 101), { ...none, failed: 1 });
  assert.deepEqual(believe({ passed: 4, failed: 0, skipped: 0 }, 1), { passed: 4, failed: 1, skipped: 0 });
  assert.deepEqual(believe({ passed: 4, failed: 2, skipped: 1 }, 1), { passed: 4, failed: 2, skipped: 1 });
  assert.deepEqual(believe({ passed: 4, failed: 0, skipped: 1 }, 0), { passed: 4, failed: 0, skipped: 1 });
});

const NOTHING = { passed: 0, failed: 0, skipped: 0 };

test('the last line names what was skipped where something was', () => {
  const outcome = { counts: { ...NOTHING, passed: 3 }, failed: false, milliseconds: 1, cpuSeconds: 1, waited: '' };
  const needed = { ...outcome, counts: null };
  assert.deepEqual(sumOf([outcome, outcome, needed]), { failed: 0, line: '6 passed, 0 failed' });
  const lacking = { ...outcome, counts: { passed: 3, failed: 1, skipped: 2 } };
  assert.deepEqual(sumOf([outcome, lacking, lacking]), { failed: 2, line: '9 passed, 2 failed, 4 skipped' });
  assert.deepEqual(sumOf([outcome, { ...needed, failed: true }]), { failed: 1, line: '3 passed, 1 failed' });
});

/** Stages that record when they begin and end. */
function recorder() {
  /** @type {string[]} */
  const log = [];
  const stage = (
    /** @type {string} */ name,
    /** @type {Partial<import('../../scripts/stages.mjs').Task>} */ more = {},
  ) => ({
    name,
    about: name,
    ...more,
    run: async () => {
      log.push(`+${name}`);
      await new Promise((resolve) => setTimeout(resolve, 20));
      log.push(`-${name}`);
      return { ...NOTHING, passed: 1 };
    },
  });
  const at = (/** @type {string} */ entry) => {
    const index = log.indexOf(entry);
    assert.notEqual(index, -1, `${entry} in ${log.join(' ')}`);
    return index;
  };
  return { log, stage, at };
}

test('a stage begins when what it needs is there, which is done once', async () => {
  const { log, stage, at } = recorder();
  const need = stage('need');
  const last = stage('last', { needs: [need] });
  const stages = [stage('first', { needs: [need, last] }), last, stage('free')];
  const outcomes = await runStages(stages);
  assert.equal(log.filter((entry) => entry === '+need').length, 1);
  assert.ok(at('-need') < at('+last') && at('-last') < at('+first'));
  assert.ok(at('+free') < at('-need'), 'what needs nothing does not wait');
  assert.equal(sumOf(outcomes.values()).line, '4 passed, 0 failed');
  const names = tableOf(stages, outcomes).map((row) => row.split(/\s+/)[0]);
  assert.deepEqual(names, ['first', 'last', 'free', 'need']);
});

test('what locks one folder of cargo goes one after the other, and only so much goes on at a time', async () => {
  const { log, stage, at } = recorder();
  const folder = 'debug';
  const stages = [
    stage('a', { folder }),
    stage('b', { folder }),
    ...Array.from({ length: NUM_AT_A_TIME }, (_, index) => stage(`other ${index}`)),
    stage('light', { busy: 0 }),
    stage('all', { busy: NUM_AT_A_TIME }),
  ];
  await runStages(stages);
  const beside = log.slice(at('+all') + 1, at('-all')).filter((entry) => !entry.endsWith('light'));
  assert.deepEqual(beside, [], 'what keeps all processors busy has them alone');
  assert.ok(at('-a') < at('+b'));
  assert.ok(at('+light') < at('-a'), 'what computes little does not wait');
  const most = log
    .filter((entry) => !entry.endsWith('light'))
    .reduce(
      ({ now, most }, entry) => {
        const next = now + (entry.startsWith('+') ? 1 : -1);
        return { now: next, most: Math.max(most, next) };
      },
      { now: 0, most: 0 },
    ).most;
  assert.equal(most, NUM_AT_A_TIME);
});

test('a stage whose need failed is not run and has failed; the others go on', async () => {
  const { log, stage, at } = recorder();
  const broken = {
    ...stage('compiler'),
    run: async () => {
      throw new Error('no compiler');
    },
  };
  const stages = [stage('rust', { needs: [broken] }), stage('docs')];
  const outcomes = await runStages(stages);
  assert.ok(!log.includes('+rust'));
  at('-docs');
  assert.equal(sumOf(outcomes.values()).line, '1 passed, 2 failed');
  const cells = tableOf(stages, outcomes).map((row) => row.replace(/ +\d[\d.]* s.*/, '').split(/\s+/));
  assert.deepEqual(cells, [
    ['rust', '1', 'failed'],
    ['docs', '1', 'passed', '0', 'failed'],
    ['compiler', '1', 'failed'],
  ]);
});

test('the table names what a stage waited for', async () => {
  const { stage } = recorder();
  const slow = {
    ...stage('engine'),
    run: async () => void (await new Promise((resolve) => setTimeout(resolve, 600))),
  };
  const stages = [stage('e2e', { needs: [slow] })];
  const [row = ''] = tableOf(stages, await runStages(stages));
  assert.match(row, /waited 0\.\d s for engine$/);
});

test("cargo's progress and tests that passed are how far a stage is", async () => {
  const { work } = await track('rust', () => {
    const own = currentWork();
    assert.ok(isProgress('   Building [=====>      ] 34/62: nalgebra, scanstitch...', own));
    assert.equal(own?.far, '34 of 62 nalgebra, scanstitch');
    assert.ok(isProgress('   Compiling nalgebra v0.35.0', own));
    assert.ok(!isProgress('test search::nearest ... ok', own));
    assert.ok(!isProgress('  ✓  12 sample.spec.ts:7 › the sample (1.2s)', own));
    assert.ok(!isProgress('warning: unused variable', own));
  });
  assert.equal(work.far, '2 passed');
});
