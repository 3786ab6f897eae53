/** Requests that wait: what the page does before an answer is there. */
import { expect, type Page } from '@playwright/test';

/** Holds the requests of this address; the function returned lets them go, and fails where there were none. */
export async function hold(page: Page, address: string | RegExp): Promise<() => Promise<void>> {
  let num_held = 0;
  let letGo = (): void => undefined;
  const released = new Promise<void>((resolve) => (letGo = resolve));
  await page.route(address, async (route) => {
    num_held++;
    await released;
    await route.continue();
  });
  return async () => {
    await expect.poll(() => num_held, { message: `requests of ${address}` }).toBeGreaterThan(0);
    letGo();
  };
}

type Gated = Window & { gate: { isClosed: boolean; numLeft: number; waiting: (() => void)[] } };

/**
 * A gate in front of the workers of pages that are opened from now on: while it is closed, what is sent to them by this method waits.
 * It closes by itself after this many, until it is opened.
 */
export async function gateWorkers(
  page: Page,
  method: string,
  numLeft: number,
): Promise<{ close(): Promise<void>; open(leastWaiting?: number): Promise<void> }> {
  const behind = { method, numLeft };
  await page.addInitScript(({ method, numLeft }) => {
    const gate = { isClosed: false, numLeft, waiting: [] as (() => void)[] };
    Object.assign(window, { gate });
    const { postMessage } = Worker.prototype;
    Worker.prototype.postMessage = function (this: Worker, message: { method?: string }, more: never): void {
      const post = (): void => postMessage.call(this, message, more);
      if (message.method !== method) return post();
      if (gate.isClosed || gate.numLeft-- <= 0) gate.waiting.push(post);
      else post();
    };
  }, behind);
  return {
    close: () => page.evaluate(() => void ((window as unknown as Gated).gate.isClosed = true)),
    /** Fails where fewer wait. */
    open: async (leastWaiting = 1) => {
      const num = (): Promise<number> => page.evaluate(() => (window as unknown as Gated).gate.waiting.length);
      await expect.poll(num, { message: `${method} sent to workers` }).toBeGreaterThanOrEqual(leastWaiting);
      await page.evaluate(() => {
        const { gate } = window as unknown as Gated;
        Object.assign(gate, { isClosed: false, numLeft: Infinity });
        for (const post of gate.waiting.splice(0)) post();
      });
    },
  };
}
