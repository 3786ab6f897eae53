/** Stops a run in its middle, from within the page: seen from outside, it may be over before the button is clicked. */
import type { Page } from '@playwright/test';

/**
 * Clicks Stop as soon as the table has more than so many rows of frames and the view says `activity`, and waits until the run has stopped. `before` and
 * `atOnce`: what the view says at the click, and when it has been drawn anew after it.
 */
export async function stopAfter(
  page: Page,
  element: string,
  num_rows: number,
  activity = '',
): Promise<{ ms: number; before: string; atOnce: string }> {
  await page.locator(element).waitFor({ state: 'attached' });
  return page.evaluate(
    async ([element, num_rows, activity]) => {
      type View = HTMLElement & { updateComplete: Promise<boolean> };
      const view = document.querySelector('scanstitch-app')?.shadowRoot?.querySelector<View>(element);
      const words = (): string => view?.shadowRoot?.textContent ?? '';
      const table = (): View | null => view?.shadowRoot?.querySelector<View>('scanstitch-frame-table') ?? null;
      const rows = (): number =>
        Number(table()?.shadowRoot?.querySelector('table')?.getAttribute('aria-rowcount') ?? 1) - 1;
      /** Until it holds, looked at whenever the view has been drawn with something new. */
      const until = (holds: () => boolean): Promise<void> =>
        new Promise((resolve) => {
          const look = async (): Promise<void> => {
            await view?.updateComplete;
            await table()?.updateComplete;
            if (!holds()) return;
            observer.disconnect();
            resolve();
          };
          const observer = new MutationObserver(() => void look());
          const changes = { childList: true, subtree: true, attributes: true, characterData: true };
          if (view?.shadowRoot) observer.observe(view.shadowRoot, changes);
          void look();
        });
      await until(() => rows() > num_rows && words().includes(activity));
      const stop = [...(view?.shadowRoot?.querySelectorAll('button') ?? [])].find(
        (button) => button.textContent === 'Stop',
      );
      if (!stop) throw new Error(`There is nothing to stop: ${words()}`);
      const before = words();
      const start = performance.now();
      stop.click();
      await view?.updateComplete;
      const atOnce = words();
      await until(() => words().includes('Stopped: ') || !words().includes('Stop'));
      if (!words().includes('Stopped: ')) throw new Error(`It was over before it stopped: ${before}`);
      return { ms: performance.now() - start, before, atOnce };
    },
    [element, num_rows, activity] as const,
  );
}
