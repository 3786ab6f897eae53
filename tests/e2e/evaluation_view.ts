/** The view of trajectories as its tests see it. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import type { Locator, Page } from '@playwright/test';
import { dropOn, expect, type InputFile } from './scanstitch_page.js';

export const DATA = join(import.meta.dirname, '../data/evaluation');
export const SHARED = join(import.meta.dirname, '../../../shared/data/trajectories');

export function file(folder: string, name: string): InputFile {
  return { name, content: readFileSync(join(folder, name)) };
}

export class EvaluationView {
  /** Opens the view over the page, and listens to what it draws. */
  constructor(readonly page: Page) {}

  async open(): Promise<void> {
    await this.page.evaluate(() => {
      const seen: number[] = [];
      Object.assign(window, { evaluations: seen });
      addEventListener('scanstitch-evaluated', (event) => seen.push((event as CustomEvent).detail.total_ms));
    });
    await this.page.getByRole('button', { name: 'Evaluate' }).click();
    await expect(this.view).toBeVisible();
  }

  get view(): Locator {
    return this.page.locator('scanstitch-evaluate');
  }

  get rows(): Locator {
    return this.page.getByRole('table', { name: 'Estimates, ranked' }).locator('tbody tr');
  }

  /** The text of a column, from the top. */
  async column(name: RegExp): Promise<string[]> {
    const heads = await this.page.getByRole('table', { name: 'Estimates, ranked' }).locator('th').allInnerTexts();
    const index = heads.findIndex((head) => name.test(head));
    return this.rows.locator(`td:nth-child(${index + 1})`).allInnerTexts();
  }

  /** Drops files, and waits until what follows from them is on the screen; what that took (ms). */
  async drop(files: readonly InputFile[]): Promise<number> {
    return this.answered(() => this.offer(files));
  }

  /** Drops files. */
  async offer(files: readonly InputFile[]): Promise<void> {
    await dropOn(this.view.locator('.evaluate'), files);
  }

  /** Does something, and waits until the figures that follow from it are on the screen; what that took (ms). */
  async answered(action: () => Promise<unknown>): Promise<number> {
    const seen = () => this.page.evaluate(() => (window as unknown as { evaluations?: number[] }).evaluations ?? []);
    const before = (await seen()).length;
    await action();
    await expect.poll(async () => (await seen()).length, { timeout: 60_000 }).toBeGreaterThan(before);
    return (await seen()).at(-1) ?? Number.NaN;
  }
}
