// @ts-check
/** 200 pairs in mixed conventions on the command line: the figures of evo. On the page: tests/e2e/evo_cases.spec.ts. */
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { test } from 'node:test';
import { EVO_FIGURES, farthestFromEvo, GROUPS } from './evo_cases.mjs';
import { scanstitch, temporaryFolder, writeFiles } from './support.mjs';

test('the conventions of both sides, ten by ten, each compared in two ways: 1e-9 from evo', async (t) => {
  let numCompared = 0;
  for (const [index, { reference, estimates, options }] of GROUPS.entries()) {
    const folder = temporaryFolder(t);
    writeFiles(folder, Object.fromEntries([reference, ...estimates].map(({ name, content }) => [name, content])));
    for (const [at, { align, metric, relation, delta, unit }] of options.entries()) {
      const { status, stdout, stderr } = await scanstitch([
        'evaluate',
        ...[reference, ...estimates].map(({ name }) => join(folder, name)),
        ...['--align', align, '--metric', metric, '--relation', relation, '--json'],
        ...(delta === undefined ? [] : ['--delta', String(delta), '--delta-unit', unit ?? '']),
      ]);
      assert.equal(status, 0, stderr);
      const found = JSON.parse(stdout).estimates;
      for (const [which, { name }] of estimates.entries()) {
        const one = found.find((/** @type {{ name: string }} */ estimate) => estimate.name === name);
        const what = `${reference.name}, ${name}, ${align} ${metric} ${relation}`;
        assert.ok(one, what);
        const off = farthestFromEvo({ ...one.statistics, num: one.num_errors }, EVO_FIGURES[index]?.[at]?.[which]);
        assert.ok(off <= 1e-9, `${what}: ${off}`);
        numCompared++;
      }
    }
  }
  assert.equal(numCompared, 200);
});
