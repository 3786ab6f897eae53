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
