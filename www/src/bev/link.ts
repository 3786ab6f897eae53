/** A scene with its marks as a link: everything but the pictures, in the fragment, which no server sees. */
import { type BevDocument, MAX_GRID, newDocument, type Tool } from './document.js';
import type { BevScene, Pixel, WholePixels } from './protocol.js';

/** What a link brings back. */
export interface Linked {
  document: BevDocument;
  /** How much of the warped top view covers the front view. */
  blend: number;
  /** Whether the pictures are the sample's. */
  isSample: boolean;
}

const NAME = 'bev';
const TOOLS: readonly Tool[] = ['polygon', 'grid', 'points', 'pairs'];
const WHOLE: readonly WholePixels[] = ['exact', 'truncated', 'rounded'];

export function fragmentOf({ document, blend, isSample }: Linked): string {
  const json = JSON.stringify({ ...document, blend, is_sample: isSample });
  const binary = Array.from(new TextEncoder().encode(json), (byte) => String.fromCharCode(byte)).join('');
  return `#${NAME}=${btoa(binary).replaceAll('+', '-').replaceAll('/', '_').replace(/=+$/, '')}`;
}

/** What the fragment holds; null without anything, an error in words where it is spoilt. */
export function readFragment(fragment: string): Linked | null {
  const text = new URLSearchParams(fragment.replace(/^#/, '')).get(NAME);
  if (!text) return null;
  let found: unknown;
  try {
    const binary = atob(text.replaceAll('-', '+').replaceAll('_', '/'));
    found = JSON.parse(
      new TextDecoder('utf-8', { fatal: true }).decode(Uint8Array.from(binary, (c) => c.charCodeAt(0))),
    );
  } catch {
    throw new Error('The link is cut off or changed, so its scene cannot be read. Copy it again, as a whole.');
  }
  const given = (typeof found === 'object' && found !== null ? found : {}) as Record<string, unknown>;
  if (typeof given.scene !== 'object' || given.scene === null) {
    throw new Error('The link holds no scene. Copy it again, as a whole.');
  }
  // What the scene's numbers mean is checked by the engine, as with any other scene.
  const document = newDocument(given.scene as BevScene);
  return {
    document: {
      ...document,
      tool: TOOLS.find((tool) => tool === given.tool) ?? document.tool,
      whole: WHOLE.find((whole) => whole === given.whole) ?? document.whole,
      points: pixels(given.points),
      corners: pixels(given.corners).slice(0, 2),
      columns: cells(given.columns) ?? document.columns,
      rows: cells(given.rows) ?? document.rows,
      pairs: list(given.pairs).flatMap((pair) => {
        const { top, front } = pair as { top: unknown; front: unknown };
        return isPixel(top) ? [{ top, front: isPixel(front) ? front : null }] : [];
      }),
    },
    blend: typeof given.blend === 'number' ? Math.min(Math.max(given.blend, 0), 1) : 0,
    isSample: given.is_sample === true,
  };
}

function pixels(value: unknown): Pixel[] {
  return list(value).filter(isPixel);
}

function isPixel(value: unknown): value is Pixel {
  return Array.isArray(value) && value.length === 2 && value.every((one) => typeof one === 'number' && isFinite(one));
}

function list(value: unknown): object[] {
  return Array.isArray(value) ? value.filter((one) => typeof one === 'object' && one !== null) : [];
}

function cells(value: unknown): number | null {
  return typeof value === 'number' && Number.isInteger(value) && value >= 1 && value <= MAX_GRID ? value : null;
}
