/** The option `--topic`, apart from what reads bags: that is loaded where there is one. */
import { ROLES } from '../bag/roles.js';
import type { Wishes } from '../bag/topics.js';
import { CommandError } from './command.js';

/** What `--topic ROLE=NAME` asks for. */
export function readWishes(texts: string[] = []): Wishes {
  const wishes: Wishes = {};
  for (const text of texts) {
    const [, role, name = ''] = text.match(/^(\w+)=(\S+)$/) ?? [];
    const known = ROLES.find((candidate) => candidate === role);
    if (!known) {
      throw new CommandError(`--topic ${text}: this is ROLE=NAME, with ${ROLES.join(', ')} for ROLE`);
    }
    wishes[known] = name === 'none' ? null : name;
  }
  return wishes;
}
