/** A course page on another host than Scanstitch's, with files beside it, and what it hears of the element. */
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test as base, expect, type Locator, type Page } from '@playwright/test';
import type { ScanstitchEvents } from '../../npm/element.js';
import { mcapBytes } from '../cli/bag_files.mjs';
import { cameraInfo, image } from '../cli/bag_messages.mjs';
import { SAMPLE_FOLDER } from './scanstitch_page.js';
import { FOCAL, HEIGHT, recording, render, walk, WIDTH } from './spatial_recording.js';

export { expect };

export const COURSE = 'http://course.example/lesson/';
/** The same host as Scanstitch's, where it has no files: what it answers there, no other site may read. */
export const CLOSED = `http://localhost:${process.env.E2E_PORT ?? 4173}/closed/`;

export type Heard = { [K in keyof ScanstitchEvents]: { type: K; of: string; detail: ScanstitchEvents[K] } };
export type Files = Record<string, string | Buffer>;

declare global {
  interface Window {
    heard: Heard[keyof Heard][];
  }
}

export class CoursePage {
  /** Errors of scripts on the page. */
  readonly faults: string[] = [];

  constructor(
    readonly page: Page,
    readonly baseURL: string,
  ) {
    page.on('pageerror', (error) => this.faults.push(error.message));
  }

  /** Opens a page with this in its body, and these files beside it. */
  async open(body: string, files: Files = {}, script = `${this.baseURL}scanstitch-app.js`): Promise<void> {
    const context = this.page.context();
    await context.route(`${COURSE}**`, (route) => {
      const path = new URL(route.request().url()).pathname.slice('/lesson/'.length);
      const file = path === '' ? `<!doctype html><title>Lesson</title>${body}${moduleTag(script)}` : files[path];
      return route.fulfill(file === undefined ? { status: 404 } : { contentType: typeOf(path), body: file });
    });
    await this.page.addInitScript(listen);
    await this.page.goto(COURSE);
  }

  get element(): Locator {
    return this.page.locator('scanstitch-app').first();
  }

  /** The first event of this type of the element with this id. */
  async heardOf<K extends keyof ScanstitchEvents>(id: string, type: K): Promise<Heard[K]> {
    const event = await this.page.waitForFunction(
      ([id, type]) => window.heard.find((event) => event.of === id && event.type === type),
      [id, type] as const,
      { timeout: 60_000 },
    );
    return event.jsonValue() as Promise<Heard[K]>;
  }

  /** The next event of this type after the first `index` of them. */
  async heard<K extends keyof ScanstitchEvents>(type: K, index = 0): Promise<Heard[K]> {
    await this.page.waitForFunction(
      ([type, index]) => window.heard.filter((event) => event.type === type).length > index,
      [type, index] as const,
      { timeout: 60_000 },
    );
    return this.page.evaluate(([type, index]) => window.heard.filter((event) => event.type === type)[index], [
      type,
      index,
    ] as const) as Promise<Heard[K]>;
  }

  get messages(): Locator {
    return this.page.getByRole('region', { name: 'Messages' });
  }
}

const moduleTag = (script: string): string => (script ? `<script type="module" src="${script}"></script>` : '');

function typeOf(path: string): string {
  if (path === '' || path.endsWith('.html')) return 'text/html';
  return path.endsWith('.js') ? 'text/javascript' : 'application/octet-stream';
}

/** Runs in the page: what the document hears of any element. */
export function listen(): void {
  window.heard = [];
  for (const type of ['scanstitch-progress', 'scanstitch-done', 'scanstitch-error', 'scanstitch-located'] as const) {
    addEventListener(type, (event) => {
      const { target, detail } = event as CustomEvent;
      window.heard.push({ type, of: (target as Element).id, detail });
    });
  }
}

/** The first scans of the sample. */
export function scans(count: number): Files {
  return Object.fromEntries(
    Array.from({ length: count }, (_, i) => [`${i}.ply`, readFileSync(join(SAMPLE_FOLDER, `${i}.ply`))]),
  );
}

/** Depth images with colours and a camera, in `room/`. */
export function depthImages(count: number): Files {
  return Object.fromEntries(recording(count).map(({ name, content }) => [name, content]));
}

/** The same room as a bag of ROS 2. */
export function bag(count: number): Buffer {
  const shape = { width: WIDTH, height: HEIGHT };
  const messages = walk(count).flatMap((pose, i) => {
    const stamp = { sec: 100 + i, nsec: 0 };
    const time = BigInt(stamp.sec) * 1_000_000_000n;
    const metres = Float32Array.from(render(pose).depth, (value) => value / 1000);
    const data = new Uint8Array(metres.buffer);
    return [
      { topic: '/depth/image', time, data: image({ stamp, ...shape, encoding: '32FC1', data }) },
      {
        topic: '/depth/camera_info',
        time,
        data: cameraInfo(stamp, WIDTH, HEIGHT, [FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2]),
      },
    ];
  });
  const topics = [
    { name: '/depth/image', type: 'sensor_msgs/msg/Image' },
    { name: '/depth/camera_info', type: 'sensor_msgs/msg/CameraInfo' },
  ];
  return Buffer.from(mcapBytes(topics, messages));
}

export const test = base.extend<{ course: CoursePage }>({
  course: async ({ page, baseURL }, use) => {
    const course = new CoursePage(page, baseURL ?? '');
    await use(course);
    // Files that are still on their way when a test ends are no fault.
    await page.context().unrouteAll({ behavior: 'ignoreErrors' });
    expect(course.faults).toEqual([]);
  },
});
