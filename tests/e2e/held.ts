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

type Gated = Window & { gate: { isClosed: boolean; waiting: (() => void)[] } };

/** A gate in front of the workers of pages that are opened from now on: while it is closed, what is sent to them by this method waits. */
export async function gateWorkers(
  page: Page,
  method: string,
): Promise<{ close(): Promise<void>; open(): Promise<void> }> {
  await page.addInitScript((method) => {
    const gate = { isClosed: false, waiting: [] as (() => void)[] };
    Object.assign(window, { gate });
    const { postMessage } = Worker.prototype;
    Worker.prototype.postMessage = function (this: Worker, message: { method?: string }, more: never): void {
      const post = (): void => postMessage.call(this, message, more);
      if (gate.isClosed && message.method === method) gate.waiting.push(post);
      else post();
    };
  }, method);
  return {
    close: () => page.evaluate(() => void ((window as unknown as Gated).gate.isClosed = true)),
    /** Fails where nothing waits. */
    open: async () => {
      const num = (): Promise<number> => page.evaluate(() => (window as unknown as Gated).gate.waiting.length);
      await expect.poll(num, { message: `${method} sent to workers` }).toBeGreaterThan(0);
      await page.evaluate(() => {
        const { gate } = window as unknown as Gated;
        gate.isClosed = false;
        for (const post of gate.waiting.splice(0)) post();
      });
    },
  };
}
