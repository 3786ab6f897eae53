/** Marks as things that can be taken hold of, moved and removed. A key is the kind of mark and its number: `p3`. */
import type { BevDocument } from './document.js';
import { letter } from './paint.js';
import type { Handle } from './picture.js';
import type { Projection, Pixel } from './protocol.js';

/** p: a point; c: a corner of the grid; t and f: a pair's place in the top and in the front view. */
export type MarkKind = 'p' | 'c' | 't' | 'f';

export interface Mark {
  kind: MarkKind;
  index: number;
}

export function markOf(key: string): Mark {
  return { kind: key.charAt(0) as MarkKind, index: Number(key.slice(1)) };
}

/** The kind of mark that rows of the table stand for. */
export function tabledKind({ tool }: BevDocument): MarkKind {
  return tool === 'pairs' ? 't' : 'p';
}

/** The change that puts a mark to another place; null where there is no such mark, or it lies there already. */
export function movedTo(document: BevDocument, { kind, index }: Mark, at: Pixel): Partial<BevDocument> | null {
  const isThere = (pixel: Pixel | null | undefined) => !pixel || (pixel[0] === at[0] && pixel[1] === at[1]);
  const placed = (all: readonly Pixel[]) => all.map((pixel, i) => (i === index ? at : pixel));
  const paired = (change: { top: Pixel } | { front: Pixel }) => ({
    pairs: document.pairs.map((pair, i) => (i === index ? { ...pair, ...change } : pair)),
  });
  switch (kind) {
    case 'p':
      return isThere(document.points[index]) ? null : { points: placed(document.points) };
    case 'c':
      return isThere(document.corners[index]) ? null : { corners: placed(document.corners) };
    case 't':
      return isThere(document.pairs[index]?.top) ? null : paired({ top: at });
    case 'f':
      return isThere(document.pairs[index]?.front) ? null : paired({ front: at });
  }
}

export function without(document: BevDocument, { kind, index }: Mark): Partial<BevDocument> {
  const rest = <T>(all: readonly T[]) => all.filter((_, i) => i !== index);
  if (kind === 'c') return { corners: rest(document.corners) };
  return kind === 'p' ? { points: rest(document.points) } : { pairs: rest(document.pairs) };
}

/** The change that removes the marks of the tool at hand. */
export function withoutAny({ tool }: BevDocument): Partial<BevDocument> {
  if (tool === 'grid') return { corners: [] };
  return tool === 'pairs' ? { pairs: [] } : { points: [] };
}

export function topHandles({ tool, points, corners, pairs }: BevDocument): Handle[] {
  const named = (kind: MarkKind, words: (index: number) => string) => (at: Pixel, index: number) => {
    return { key: `${kind}${index}`, at, label: words(index) };
  };
  if (tool === 'grid') return corners.map(named('c', (index) => `Corner ${index + 1} of the grid`));
  if (tool === 'pairs') return pairs.map(({ top }) => top).map(named('t', (index) => `Pair ${letter(index)}, top`));
  return points.map(named('p', (index) => `Point ${index + 1}`));
}

/** Projections can be taken hold of as well: the point follows. */
export function frontHandles(answered: { document: BevDocument; answer: Projection } | null): Handle[] {
  if (!answered || answered.document.tool === 'grid') return [];
  const { document, answer } = answered;
  if (document.tool === 'pairs') {
    return document.pairs.flatMap(({ front }, index) =>
      front ? [{ key: `f${index}`, at: front, label: `Pair ${letter(index)}, front` }] : [],
    );
  }
  return answer.points.flatMap(({ projected, status }, index) =>
    status === 'visible' && projected
      ? [{ key: `p${index}`, at: projected, label: `Point ${index + 1} in the front view` }]
      : [],
  );
}

/** A mark put where there is none in the top view, by the tool that is chosen. */
export function withMark(document: BevDocument, at: Pixel): { change: Partial<BevDocument>; mark: Mark } {
  if (document.tool === 'grid') {
    const corners = document.corners.length < 2 ? [...document.corners, at] : [at];
    return { change: { corners }, mark: { kind: 'c', index: corners.length - 1 } };
  }
  if (document.tool === 'pairs') {
    // A pair whose second place was not marked is given up.
    const complete = document.pairs.filter(({ front }) => front !== null);
    const pairs = [...complete, { top: at, front: null }];
    return { change: { pairs }, mark: { kind: 't', index: complete.length } };
  }
  return { change: { points: [...document.points, at] }, mark: { kind: 'p', index: document.points.length } };
}
