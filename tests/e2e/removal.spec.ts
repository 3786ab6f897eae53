/** An element that is removed from its page leaves nothing behind: no memory, no worker. */
import { type CDPSession } from '@playwright/test';
import { depthImages, expect, scans, test } from './course_page.js';

const ROUNDS = 50;
/** Rounds before the first measurement: what is kept once for all elements (modules, fonts, compiled code) is there. */
const WARM_UP = 5;
const MOST_GROWTH_BYTES = 5 * 2 ** 20;

/** Memory of the page that is still in use after a collection: objects, their array buffers, and those of the DOM (bytes). */
async function usedBytes(session: CDPSession): Promise<number> {
  // Finalizers of one collection free what the next one finds.
  for (let i = 0; i < 3; i += 1) await session.send('HeapProfiler.collectGarbage');
  const usage: Record<string, number> = await session.send('Runtime.getHeapUsage');
  return ['usedSize', 'backingStorageSize', 'embedderHeapUsedSize'].reduce((sum, name) => sum + (usage[name] ?? 0), 0);
}

/** Elements that are still in memory after a collection. */
async function numElements(session: CDPSession): Promise<number> {
  const group = { objectGroup: 'elements' };
  const expression = "customElements.get('scanstitch-app').prototype";
  const { result } = await session.send('Runtime.evaluate', { expression, ...group });
  const found = await session.send('Runtime.queryObjects', { prototypeObjectId: result.objectId ?? '', ...group });
  const { result: properties } = await session.send('Runtime.getProperties', {
    objectId: found.objects.objectId ?? '',
    ownProperties: true,
  });
  await session.send('Runtime.releaseObjectGroup', group);
  return properties.find(({ name }) => name === 'length')?.value?.value as number;
}

for (const [what, files, src] of [
  ['scans', scans(3), '0.ply 1.ply 2.ply'],
  ['depth images', depthImages(3), 'set.json'],
] as const) {
  test(`the heap does not grow over ${ROUNDS} rounds of opening ${what} and removing the element`, async ({
    course,
    page,
  }) => {
    test.setTimeout(300_000);
    const list = (folder: string): string[] => Object.keys(files).filter((name) => name.includes(folder));
    const manifest = { depth: list('depth'), color: list('rgb'), files: 'room/camera-intrinsics.txt' };
    await course.open('', { ...files, 'set.json': JSON.stringify(manifest) });
    const session = await page.context().newCDPSession(page);
    const round = (): Promise<void> =>
      page.evaluate(async (src) => {
        const element = document.createElement('scanstitch-app');
        element.setAttribute('src', src);
        const done = new Promise((resolve) => element.addEventListener('scanstitch-done', resolve, { once: true }));
        document.body.append(element);
        await done;
        element.remove();
        window.heard = [];
      }, src);
    for (let i = 0; i < WARM_UP; i += 1) await round();
    const before = await usedBytes(session);
    let numWorkers = 0;
    page.on('worker', () => (numWorkers += 1));
    for (let i = 0; i < ROUNDS; i += 1) await round();
    const grown = (await usedBytes(session)) - before;
    expect(grown).toBeLessThan(MOST_GROWTH_BYTES);
    // One that is held tells that the count sees it.
    await page.evaluate(() => Object.assign(window, { held: document.createElement('scanstitch-app') }));
    expect(await numElements(session), 'elements in memory').toBe(1);
    expect(numWorkers, 'workers started').toBeGreaterThanOrEqual(ROUNDS);
    expect(page.workers(), 'workers alive').toEqual([]);
  });
}
