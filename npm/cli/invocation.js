// @ts-check
/** One invocation of the command line: where it prints, and the files that it has written. */
import { AsyncLocalStorage } from 'node:async_hooks';

/** @typedef {{ write: (text: string) => unknown, isTTY?: boolean }} Output */
/**
 * @typedef {object} Invocation
 * @property {Output} stdout
 * @property {Output} stderr
 * @property {string[]} written paths of the files that are complete, in their order
 */

/** The one of this process. @type {Invocation} */
const OF_PROCESS = { stdout: process.stdout, stderr: process.stderr, written: [] };

/** @type {AsyncLocalStorage<Invocation>} */
const invocations = new AsyncLocalStorage();

/** The invocation that the caller is part of. */
export function invocation() {
  return invocations.getStore() ?? OF_PROCESS;
}

/**
 * Does work as an invocation of its own.
 * @template T
 * @param {{ stdout: Output, stderr: Output }} outputs
 * @param {() => Promise<T>} work
 */
export function invoke({ stdout, stderr }, work) {
  return invocations.run({ stdout, stderr, written: [] }, work);
}
