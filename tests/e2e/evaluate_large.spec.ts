/**
 * A hundred thousand poses, from the drop to the drawn figures, and hovering over them. Times go into the report (the
 * list of annotations), together with what an idle frame takes in the same run: a busy machine fails no test.
 */
import { EvaluationView } from './evaluation_view.js';
import { expect, test } from './scanstitch_page.js';

const NUM_POSES = 100_000;

/** As files of the field have it: times in 100 us, positions in micrometres. */
function trajectory(noise: number): string {
  const line = (index: number): string => {
    const s = index / 4000;
    const off = noise * Math.sin(index * 0.37);
    const position = [30 * Math.sin(s) + off, 20 * Math.sin(0.61 * s), 2 * Math.cos(0.3 * s) - off];
    const numbers = [...position, 0, 0, Math.sin(s / 2), Math.cos(s / 2)].map((value) => value.toFixed(6));
    return `${(index / 100).toFixed(4)} ${numbers.join(' ')}\n`;
  };
  return Array.from({ length: NUM_POSES }, (_, index) => line(index)).join('');
}

test('a hundred thousand poses are drawn, and hovering over them keeps up', async ({ app, page }, info) => {
  const evaluation = new EvaluationView(page);
  await evaluation.open();
  const files = [
    { name: 'gt.tum', content: trajectory(0) },
    { name: 'est.tum', content: trajectory(0.05) },
  ];
  await page.getByRole('button', { name: 'Remove all' }).click();
  const dropped = await evaluation.drop(files);
  const aligned = await evaluation.answered(() => page.getByLabel('Alignment').selectOption('sim3'));
  await expect(evaluation.rows).toHaveCount(1);
  await expect(evaluation.rows.locator('td').nth(2)).toHaveText('100000/100000');

  const hover = (name: string | null): Promise<{ frame: number; script: number }> =>
    page.evaluate(async (section) => {
      const find = (root: ParentNode, selector: string): HTMLElement | null => {
        const found = root.querySelector<HTMLElement>(selector);
        if (found) return found;
        for (const element of root.querySelectorAll('*')) {
          const inside = element.shadowRoot && find(element.shadowRoot, selector);
          if (inside) return inside;
        }
        return null;
      };
      const figure = section && find(document, `section.${section} scanstitch-figure`);
      const target = figure ? figure.shadowRoot?.querySelector('div') : null;
      const box = figure ? figure.getBoundingClientRect() : new DOMRect();
      const frames: number[] = [];
      const scripts: number[] = [];
      let before = await new Promise<number>(requestAnimationFrame);
      for (let i = 0; i < 60; i++) {
        const start = performance.now();
        const place = { clientX: box.x + 80 + (i % 40) * 8, clientY: box.y + box.height / 2 + (i % 7) * 5 };
        target?.dispatchEvent(new PointerEvent('pointermove', { ...place, bubbles: true, composed: true }));
        // All that follows from it is done in microtasks.
        await new Promise<void>((resolve) => setTimeout(resolve));
        scripts.push(performance.now() - start);
        const now = await new Promise<number>(requestAnimationFrame);
        frames.push(now - before);
        before = now;
      }
      const middle = (values: number[]) => values.sort((a, b) => a - b)[values.length >> 1] ?? Number.NaN;
      return { frame: middle(frames), script: middle(scripts) };
    }, name);
  const idle = await hover(null);
  const errors = await hover('errors');
  await expect(evaluation.view.locator('.readout')).toContainText('error');
  const paths = await hover('paths');

  const tell = (type: string, description: string): void => {
    info.annotations.push({ type, description });
    console.log(`${type}: ${description}`);
  };
  tell('from drop to drawn', `${dropped.toFixed(0)} ms`);
  tell('another alignment, compared and drawn', `${aligned.toFixed(0)} ms`);
  for (const [what, found] of Object.entries({ idle, errors, paths })) {
    tell(`a frame, ${what}`, `${found.frame.toFixed(1)} ms, of which script ${found.script.toFixed(1)} ms`);
  }
  expect(app.faults).toEqual([]);
});
