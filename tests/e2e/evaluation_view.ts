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

declare global {
  interface Window {
    /** What each evaluation took (ms), since the view was opened. */
    evaluations?: number[];
  }
}

export class EvaluationView {
  /** Opens the view over the page, and listens to what it draws. */
  constructor(readonly page: Page) {}

  async open(): Promise<void> {
    await this.page.evaluate(() => {
      const seen: number[] = [];
      window.evaluations = seen;
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

  /** Drops files, and waits until what follows from them is on the screen. */
  async drop(files: readonly InputFile[]): Promise<void> {
    return this.answered(() => this.offer(files));
  }

  /** Drops files. */
  async offer(files: readonly InputFile[]): Promise<void> {
    await dropOn(this.view.locator('.evaluate'), files);
  }

  /** Does something, and waits until the figures that follow from it are on the screen. */
  async answered(action: () => Promise<unknown>): Promise<void> {
    const before = await this.page.evaluate(() => window.evaluations?.length ?? 0);
    await action();
    await this.page.waitForFunction((before) => (window.evaluations?.length ?? 0) > before, before, {
      timeout: 60_000,
    });
  }
}
