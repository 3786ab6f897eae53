/** Queries of which the latest counts. */
import { expect, test } from '@playwright/test';
import { LatestQuery } from '../../www/src/engine/latest-query.js';

/** Queries that are computed when the test says so, and what became of each. */
function setUp() {
  const told: string[] = [];
  const computing = new Map<string, { resolve(result: string): void; reject(error: Error): void }>();
  const queries = new LatestQuery<string, string>({
    compute: (query) => new Promise((resolve, reject) => computing.set(query, { resolve, reject })),
    answered: (query, result, isLatest) => told.push(`${query}: ${result}${isLatest ? '' : ', not the latest'}`),
    failed: (query, error) => told.push(`${query} failed: ${(error as Error).message}`),
  });
  return { queries, computing, told };
}

/** All promises that can be settled are. */
const settled = (): Promise<void> => new Promise((resolve) => setTimeout(resolve));

test('while a query is answered, only the last one after it waits', async () => {
  const { queries, computing, told } = setUp();
  for (const query of ['a', 'b', 'c']) queries.ask(query);
  expect([...computing.keys()]).toEqual(['a']);
  computing.get('a')?.reject(new Error('no'));
  await settled();
  expect([...computing.keys()]).toEqual(['a', 'c']);
  queries.ask('d');
  computing.get('c')?.resolve('1');
  await settled();
  expect([...computing.keys()]).toEqual(['a', 'c', 'd']);
  computing.get('d')?.reject(new Error('no again'));
  await settled();
  expect(told).toEqual(['a failed: no', 'c: 1, not the latest', 'd failed: no again']);
});

test('dropped queries are neither answered nor failed, and a later one is answered', async () => {
  const { queries, computing, told } = setUp();
  queries.ask('a');
  queries.ask('b');
  queries.drop();
  queries.ask('c');
  computing.get('a')?.resolve('1');
  await settled();
  expect([...computing.keys()]).toEqual(['a', 'c']);
  queries.drop();
  computing.get('c')?.reject(new Error('no'));
  await settled();
  expect(told).toEqual([]);
  queries.ask('d');
  computing.get('d')?.resolve('2');
  await settled();
  expect(told).toEqual(['d: 2']);
});
