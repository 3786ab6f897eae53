// @ts-check
/** Before `npm pack`, what the package holds is built where it is missing; before `npm publish`, always. Of its own files, what
 * has changed is emitted. */
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { buildPackage } from './engine.mjs';
import { tellOn } from './progress.mjs';
import { ROOT, run, runMain } from './steps.mjs';

await runMain(async () => {
  tellOn(process.stderr); // `npm pack --json` has the stdout
  /** @type {{ files: string[] }} */
  const { files } = JSON.parse(readFileSync(join(ROOT, 'package.json'), 'utf8'));
  const isComplete = files.every((path) => path.startsWith('!') || existsSync(join(ROOT, path)));
  if (!isComplete || process.env.npm_command === 'publish') await run(process.execPath, ['scripts/build.mjs']);
  else await buildPackage();
});
