/** Pictures of the two views, and where they come from. */
import { fetchOk } from '../datasets/fetch-ok.js';
import { baseName } from '../views/format.js';
import type { BevRole } from './protocol.js';

export interface Picture {
  name: string;
  bitmap: ImageBitmap;
}

/** Addresses of the built-in pair, where it is built in: both pictures and its scene. */
const sampleFiles = import.meta.glob<string>('../../samples/bev/{top.jpg,front.jpg,scene.json}', {
  query: '?url',
  import: 'default',
  eager: true,
});

export const hasSample = Object.keys(sampleFiles).length === 3;

/** One of the built-in files. */
export async function fetchSampleFile(name: 'top.jpg' | 'front.jpg' | 'scene.json'): Promise<Blob> {
  const [, url] = Object.entries(sampleFiles).find(([path]) => path.endsWith(`/${name}`)) ?? [];
  if (!url) throw new Error('This copy of Scanstitch has no sample pair.');
  return fetchBlob(url);
}

export async function fetchBlob(url: string): Promise<Blob> {
  return (await fetchOk(url)).blob();
}

/** Decodes a picture; in words where it is none. */
export async function decodePicture(name: string, blob: Blob): Promise<Picture> {
  try {
    return { name, bitmap: await createImageBitmap(blob) };
  } catch {
    throw new Error(`${name} is not an image that this browser can show. Use a PNG or JPEG file.`);
  }
}

/** Red, green, blue and opacity of every pixel. */
export function pixelsOf({ bitmap }: Picture): Uint8Array<ArrayBuffer> {
  const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
  const context = canvas.getContext('2d', { willReadFrequently: true });
  if (!context) throw new Error('The browser gives no canvas to read the picture with.');
  context.drawImage(bitmap, 0, 0);
  return new Uint8Array(context.getImageData(0, 0, bitmap.width, bitmap.height).data.buffer);
}

/** The view that a file shows, by its name; null where the name does not say. */
export function roleOfName(name: string): BevRole | null {
  const base = baseName(name).toLowerCase();
  if (/front|forward|fpv|ego/.test(base)) return 'front';
  return /top|bev|bird|above|down/.test(base) ? 'top' : null;
}
