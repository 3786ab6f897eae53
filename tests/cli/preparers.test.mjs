// @ts-check
/** Threads that prepare frames: none outlives its run, so that the program ends. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { startPreparers } from '../../npm/cli/preparers.js';
import * as engine from '../../npm/index.js';

test('a run that is stopped while a file is read starts no thread afterwards', async () => {
  await engine.load();
  const [preparer] = await startPreparers(engine, 1);
  assert.ok(preparer);
  /** @type {(bytes: Uint8Array) => void} */
  let letGo = () => undefined;
  const bytes = new Promise((/** @type {(bytes: Uint8Array) => void} */ resolve) => (letGo = resolve));
  const read = () => bytes;
  const file = { path: '1.png', size: 4, read, readHead: read };
  const stopping = new AbortController();
  const job = { index: 0, name: '1.png', time: null, kind: /** @type {const} */ ('depth_images'), file, color: null };
  const prepared = preparer.prepare(job, '{}', stopping.signal);
  stopping.abort();
  await preparer.close();
  letGo(new Uint8Array(4));
  await assert.rejects(async () => prepared, { name: 'AbortError' });
});
