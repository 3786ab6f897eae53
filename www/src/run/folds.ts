/** Which panels around the map are unfolded: none at first, so that the map has the room. */
import type { Panel } from './run-kind.js';

/** A panel, or the tabs below the map where that is narrow. */
export type Fold = Panel | 'tabs';

/** Asks for a panel to be unfolded or folded; `isLasting`: that it is remembered where the element may remember. */
export interface FoldChange {
  fold: Fold;
  isOpen: boolean;
  isLasting: boolean;
}

const KEY = 'scanstitch-panels';
const FOLDS: readonly string[] = ['figures', 'table', 'details', 'settings', 'tabs'] satisfies Fold[];
export const NONE_OPEN: ReadonlySet<Fold> = new Set();

/** A page may have forbidden its frames to store anything. */
export function rememberedFolds(): ReadonlySet<Fold> {
  try {
    const names = (localStorage.getItem(KEY) ?? '').split(' ');
    return new Set(names.filter((name) => FOLDS.includes(name)) as Fold[]);
  } catch {
    return NONE_OPEN;
  }
}

export function rememberFolds(open: ReadonlySet<Fold>): void {
  try {
    localStorage.setItem(KEY, [...open].join(' '));
  } catch {
    // The choice holds until the page is closed.
  }
}

/** These, with one unfolded or folded. */
export function changedFolds(open: ReadonlySet<Fold>, { fold, isOpen }: FoldChange): ReadonlySet<Fold> {
  const others = [...open].filter((one) => one !== fold);
  return new Set(isOpen ? [...others, fold] : others);
}
