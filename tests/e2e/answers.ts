/** What the workers of a page have answered, and still owe. */
import type { Page } from '@playwright/test';

declare global {
  interface Window {
    /** Of every worker, from the first to the last: what it was asked and has answered so far, and how many calls it has not answered. */
    answers: { address: string; asked: string[]; values: unknown[]; num_owed: number }[];
  }
}

/** From the next page on, what workers answer is noted. */
export async function noteAnswers(page: Page): Promise<void> {
  await page.addInitScript(() => {
    window.answers = [];
    window.Worker = class extends Worker {
      constructor(url: string | URL, options?: WorkerOptions) {
        super(url, options);
        const own = { address: String(url), asked: [] as string[], values: [] as unknown[], num_owed: 0 };
        window.answers.push(own);
        this.addEventListener('message', ({ data }) => {
          if ('id' in data) own.num_owed--;
          if ('value' in data) own.values.push(data.value);
        });
        const [post, end] = [this.postMessage.bind(this), this.terminate.bind(this)];
        this.postMessage = (message: { method: string }, more?: Transferable[] | StructuredSerializeOptions) => {
          own.asked.push(message.method);
          own.num_owed++;
          post(message, more as StructuredSerializeOptions);
        };
        this.terminate = () => {
          own.num_owed = 0;
          end();
        };
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

/** Waits until no worker has anything to do: one that computes a run owes an answer all the time. */
export async function idle(page: Page): Promise<void> {
  await page.waitForFunction(() => window.answers.every(({ num_owed }) => num_owed === 0));
}
