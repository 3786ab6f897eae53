/// <reference types="node" />
/**
 * What the builds of page and element share. Scripts that are built as one: in pieces, one for each set of later views that share
 * it, the first would be fifteen requests.
 */
import { join } from 'node:path';
import type { Rolldown } from 'vite';

type CodeSplittingGroup = NonNullable<Rolldown.CodeSplittingOptions['groups']>[number];
type Modules = Rolldown.ChunkingContext;

/** The package's sources are built, not what is emitted of them. */
export const FORMATS_ENGINE = {
  '#formats-engine': join(import.meta.dirname, '../package/archive/engine_in_browser.ts'),
};

/** One script of these modules of www/src and all that they import at once, but for what is in a group before it. */
export function oneScript(name: string, entries: readonly string[]): CodeSplittingGroup {
  let found: Set<string> | null = null;
  const collect = (modules: Modules): Set<string> => {
    const all = new Set<string>();
    const add = (id: string): void => {
      if (all.has(id)) return;
      all.add(id);
      modules.getModuleInfo(id)?.importedIds.forEach(add);
    };
    entries.forEach((entry) => add(join(import.meta.dirname, 'src', entry)));
    return all;
  };
  return { name: (id, modules) => ((found ??= collect(modules)).has(id) ? name : null), debugName: name };
}
