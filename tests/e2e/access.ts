/** What every view of the page has to keep to, for those who do not see it, or not well. */
import type { Locator, Page } from '@playwright/test';
import { expect } from './scanstitch_page.js';

/** Every control that is shown has a name. */
export async function expectNamedControls(page: Page): Promise<void> {
  const controls: Locator[] = await page
    .locator('button:visible, input:visible, select:visible, [role=tab]:visible, [tabindex="0"]:visible')
    .all();
  expect(controls.length).toBeGreaterThan(10);
  for (const control of controls) await expect(control).toHaveAccessibleName(/\w/);
}

/** Names of the controls that so many presses of Tab reach; the focus is seen on each. */
export async function tabbedThrough(page: Page, most: number): Promise<string[]> {
  const reached: string[] = [];
  for (let i = 0; i < most; i++) {
    await page.keyboard.press('Tab');
    const stop = await page.evaluate(() => {
      let element = document.activeElement;
      while (element?.shadowRoot?.activeElement) element = element.shadowRoot.activeElement;
      if (!element || element === document.body) return null;
      const { outlineStyle, outlineWidth } = getComputedStyle(element);
      const label = (element as HTMLInputElement).labels?.[0]?.textContent ?? '';
      const name = element.getAttribute('aria-label') ?? (label || element.textContent || element.tagName);
      return { name: name.trim().replace(/\s+/g, ' '), isSeen: outlineStyle !== 'none' && outlineWidth !== '0px' };
    });
    if (!stop) break;
    expect(stop, 'the focus is seen').toMatchObject({ isSeen: true });
    reached.push(stop.name);
  }
  return reached;
}

/** Runs in the page: texts whose contrast to their background is below 4.5 (3 where they are large), WCAG 2 AA. */
export function findWeakContrast(): string[] {
  const probe = document.createElement('canvas').getContext('2d', { willReadFrequently: true });
  const rgba = (color: string): [number, number, number, number] => {
    if (!probe) return [0, 0, 0, 1];
    probe.clearRect(0, 0, 1, 1);
    probe.fillStyle = color;
    probe.fillRect(0, 0, 1, 1);
    const [r = 0, g = 0, b = 0, a = 0] = probe.getImageData(0, 0, 1, 1).data;
    return [r, g, b, a / 255];
  };
  const luminance = ([r, g, b]: readonly number[]): number => {
    const linear = (v = 0): number => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4);
    return 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
  };
  const parentOf = (element: Element): Element | null =>
    element.assignedSlot ??
    element.parentElement ??
    ((element.getRootNode() as ShadowRoot).host as Element | undefined) ??
    null;
  const backgroundOf = (element: Element): readonly number[] => {
    for (let at: Element | null = element; at; at = parentOf(at)) {
      const color = rgba(getComputedStyle(at).backgroundColor);
      if (color[3] > 0.98) return color;
    }
    return [255, 255, 255];
  };
  const weak: string[] = [];
  const visit = (root: Document | ShadowRoot): void => {
    for (const element of root.querySelectorAll('*')) {
      if (element.shadowRoot) visit(element.shadowRoot);
      const text = [...element.childNodes]
        .filter((node) => node.nodeType === Node.TEXT_NODE)
        .map((node) => node.textContent?.trim());
      const style = getComputedStyle(element);
      const isIdle = element.closest(':disabled') !== null;
      if (text.join('') === '' || isIdle || !element.checkVisibility() || element.closest('.visually-hidden, title'))
        continue;
      const color = rgba(element instanceof SVGElement ? style.fill : style.color);
      const [a, b] = [luminance(color), luminance(backgroundOf(element))];
      const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
      const is_large = Number.parseFloat(style.fontSize) >= 18.66;
      if (ratio < (is_large ? 3 : 4.5)) weak.push(`${text.join(' ')}: ${ratio.toFixed(2)}`);
    }
  };
  visit(document);
  return weak;
}
