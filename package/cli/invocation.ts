/** One invocation of the command line: where it prints, and the files that it has written. */
import { AsyncLocalStorage } from 'node:async_hooks';

type Output = { write: (text: string) => unknown; isTTY?: boolean };
interface Invocation {
  stdout: Output;
  stderr: Output;
  /** Paths of the files that are complete, in their order. */
  written: string[];
}

/** The one of this process. */
const OF_PROCESS: Invocation = { stdout: process.stdout, stderr: process.stderr, written: [] };

const invocations: AsyncLocalStorage<Invocation> = new AsyncLocalStorage();

/** The invocation that the caller is part of. */
export function invocation() {
  return invocations.getStore() ?? OF_PROCESS;
}

/** Does work as an invocation of its own. */
export function invoke<T>({ stdout, stderr }: { stdout: Output; stderr: Output }, work: () => Promise<T>) {
  return invocations.run({ stdout, stderr, written: [] }, work);
}
