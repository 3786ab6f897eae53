/** What the workers of a page have answered. */
import type { Page } from '@playwright/test';

declare global {
  interface Window {
    /** Of every worker, from the first to the last, what it has answered so far. */
    answers: { address: string; values: unknown[] }[];
  }
}

/** From the next page on, what workers answer is noted. */
export async function noteAnswers(page: Page): Promise<void> {
  await page.addInitScript(() => {
    window.answers = [];
    window.Worker = class extends Worker {
      constructor(url: string | URL, options?: WorkerOptions) {
        super(url, options);
        const own = { address: String(url), values: [] as unknown[] };
        window.answers.push(own);
        this.addEventListener('message', ({ data }) => 'value' in data && own.values.push(data.value));
      }
    };
  });
}

/** Waits until the newest worker of this script has answered: to begin with, that it has started. */
export async function answered(page: Page, script: RegExp): Promise<void> {
  await page.waitForFunction((source) => {
    const newest = window.answers.findLast(({ address }) => new RegExp(source).test(address));
    return newest !== undefined && newest.values.length > 0;
  }, script.source);
}
